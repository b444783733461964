"""The page and the table of a batch."""

from __future__ import annotations

import csv
import io
from collections import Counter
from collections.abc import Sequence
from html import escape
from pathlib import Path

from ..counted import counted
from ..files import write_text_atomic
from ..fit.fit_quality import FitQuality
from .rig_errors import rig_errors
from .summary import FAILED, FINISHED, WAITING, Summary

PAGE, TABLE = "collection.html", "collection.csv"
STYLE = Path(__file__).parents[2] / "assets" / "report" / "style.css"
REFRESH_SECONDS = 5  # of the page while the batch runs
FORMULA_STARTS = ("=", "+", "-", "@", "\t", "\r")  # spreadsheets run a cell that begins so
OWN_STYLE = (
    "table.objects td{padding:.4rem .9rem .4rem 0;vertical-align:middle}"
    "table.objects img{width:64px}td.failed{color:#a33}td.waiting{color:#889}"
)
COLUMNS = (
    "name", "session", "state", "materials", "typical error", "normals (degrees)", "causes",
    "warnings", "seconds", "memory (MB)", "attempts", "error", "capture",
)  # fmt: skip


def write_page(out: Path, summaries: Sequence[Summary], running: bool) -> None:
    """Write collection.html and collection.csv. running: the page loads itself again."""
    write_text_atomic(out / PAGE, _html(summaries, running))
    write_text_atomic(out / TABLE, _csv(summaries))


def _html(summaries: Sequence[Summary], running: bool) -> str:
    states = Counter(one.state for one in summaries)
    count = f"{states[FINISHED]} of {counted(len(summaries), 'object')} finished"
    more = [f"{states[kind]} {kind}" for kind in (FAILED, WAITING) if states[kind]]
    refresh = f"<meta http-equiv='refresh' content='{REFRESH_SECONDS}'>" if running else ""
    common = "".join(f"<p class='warn'>{escape(one.sentence)}</p>" for one in rig_errors(summaries))
    order = {FAILED: 0, FINISHED: 1, WAITING: 2}
    rows = "".join(_row(s) for s in sorted(summaries, key=lambda s: (order[s.state], s.item.name)))
    return (
        f"<!doctype html><html lang='en'><meta charset='utf-8'>{refresh}<title>Patina: collection"
        f"</title><style>{STYLE.read_text('utf-8')}{OWN_STYLE}</style><h1>Collection</h1><p "
        f"class='sub'>{escape(', '.join([count, *more]))}</p>{common}<table class='objects'><tr>"
        "<th></th><th>Object</th><th>Error of a held-out photo</th><th>Scan's normals</th><th>"
        f"Causes</th><th>Time, memory</th></tr>{rows}</table></html>"
    )


def _row(one: Summary) -> str:
    name = escape(one.item.name)
    if one.report:
        name = f"<a href='{escape(one.report)}'>{name}</a>"
    if one.item.session:
        name += f"<br><small>{escape(one.item.session)}</small>"
    if one.state != FINISHED:
        text = escape(one.error or "waiting")
        tries = f" ({counted(one.attempts, 'attempt')})" if one.attempts > 1 else ""
        cell = f"<td class='{one.state}' colspan='4'>{text}{tries}</td>"
        return f"<tr><td></td><td>{name}</td>{cell}</tr>"
    picture = f"<img src='{escape(one.sphere)}' alt='' loading='lazy'>" if one.sphere else ""
    typical = "" if one.typical is None else FitQuality(one.typical).sentence
    normals = "" if one.normals is None else f"{one.normals:.2f}°"
    again = f", attempt {one.attempts}" if one.attempts > 1 else ""
    cells = (
        picture, name, escape(typical), normals, escape(_causes(one)),
        f"{one.seconds:.0f} s, {one.peak_mb:.0f} MB{again}",
    )  # fmt: skip
    return "<tr>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>"


def _causes(one: Summary) -> str:
    if one.causes is None:
        return ""
    return ", ".join(cause.label for cause in one.causes if cause.named) or "none found"


def _csv(summaries: Sequence[Summary]) -> str:
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(COLUMNS)
    for one in sorted(summaries, key=lambda s: s.item.name):
        table.writerow(_safe(value) for value in (
            one.item.name, one.item.session, one.state, ", ".join(one.materials),
            "" if one.typical is None else f"{one.typical:.4g}",
            "" if one.normals is None else f"{one.normals:.4g}", _causes(one),
            "; ".join(one.warnings), f"{one.seconds:.1f}", f"{one.peak_mb:.0f}",
            str(one.attempts), one.error, str(one.item.capture),
        ))  # fmt: skip
    return text.getvalue()


def _safe(value: str) -> str:
    """A cell that no spreadsheet takes for a formula."""
    return f"'{value}" if value.startswith(FORMULA_STARTS) else value
