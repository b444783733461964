"""A batch as a job of the engines that studios have: Open Job Description (a template in JSON), and
a job type of Flamenco (JavaScript). Each object is one task: `batch … --only NAME`."""

from __future__ import annotations

import json
import shlex
from collections.abc import Sequence
from pathlib import Path

from ..errors import InputError
from ..files import write_text_atomic
from .cluster import Limits

OPENJD, FLAMENCO = "patina.openjd.json", "patina_batch.js"  # names of the files
MAX_VALUES = 1024  # of a task parameter of Open Job Description
EXPRESSION = "{{"  # begins an expression in its texts


def write_openjd(out: Path, names: Sequence[str], words: Sequence[str], limits: Limits) -> Path:
    """Write the template of a job with one task for each object (specification 2023-09), in steps
    of up to MAX_VALUES. words: the command, to which the name of an object is added. Returns its
    path. Raises InputError for a path that a template cannot hold."""
    for word in words:
        if EXPRESSION in word:
            raise InputError(f"has {EXPRESSION!r} in its path; rename it", file=Path(word))
    run: dict[str, object] = {"command": "{{Task.File.Run}}"}
    if limits.seconds:
        run["timeout"] = max(1, int(limits.seconds))
    script = {
        "actions": {"onRun": run},
        "embeddedFiles": [
            {
                "name": "Run", "type": "TEXT", "runnable": True, "filename": "run.sh",
                "data": f"#!/bin/sh\nexec {shlex.join(words)} '{{{{Task.Param.Object}}}}'\n",
            }
        ],
    }  # fmt: skip
    amount = {"name": "amount.worker.memory", "min": int(limits.gigabytes * 1024)}  # MiB
    memory = {"hostRequirements": {"amounts": [amount]}} if limits.gigabytes else {}
    parts = [names[begin : begin + MAX_VALUES] for begin in range(0, len(names), MAX_VALUES)]
    template = {
        "specificationVersion": "jobtemplate-2023-09",
        "name": "Patina",
        "steps": [
            {
                "name": f"Objects {number}",
                "parameterSpace": {
                    "taskParameterDefinitions": [
                        {"name": "Object", "type": "STRING", "range": list(part)}
                    ]
                },
                **memory,
                "script": script,
            }
            for number, part in enumerate(parts, 1)
        ],
    }
    path = out / OPENJD
    write_text_atomic(path, json.dumps(template, indent=1) + "\n")
    return path


def write_flamenco(out: Path, names: Sequence[str], words: Sequence[str]) -> Path:
    """Write a job type with one task for each object; it belongs into Flamenco's folder
    ``scripts``. words: as of write_openjd. Returns its path."""
    script = f"""// Written by `patina batch --to flamenco`. Copy this file to the folder
// "scripts" of the Flamenco Manager, and submit a job of the type "Patina Batch".
const JOB_TYPE = {{
    label: "Patina Batch",
    settings: [],
}};

const OBJECTS = {json.dumps(list(names), indent=1)};
const EXE = {json.dumps(words[0])};
const ARGS = {json.dumps(list(words[1:]), indent=1)};

function compileJob(job) {{
    for (const name of OBJECTS) {{
        const task = author.Task(name, "misc");
        task.addCommand(author.Command("exec", {{ exe: EXE, args: ARGS.concat([name]) }}));
        job.addTask(task);
    }}
}}
"""
    path = out / FLAMENCO
    write_text_atomic(path, script)
    return path
