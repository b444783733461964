"""The part of a diagnosis's report for scientists: parameters, calibration, sensor residuals."""

from __future__ import annotations

from html import escape

import numpy as np

from ..diagnose.assessment.assessment import Assessment
from ..diagnose.assessment.calibration import CONFIDENCE, INTERVAL, Calibration
from ..diagnose.assessment.joint_parameters import CONFUSABLE, JointParameters
from ..diagnose.assessment.sensor_residuals import SensorResiduals
from ..diagnose.effects.labels import cause_label
from .svg_element import svg_element

WIDTH, HEIGHT = 280, 130
LEFT, BOTTOM, TOP = 34, 18, 8
CELL = 12  # pixels of a cell of the sensor, and of a correlation
FULL_RESIDUAL = 0.1  # relative residual of full colour
MAX_MATRIX = 60  # parameters of a correlation matrix that is drawn
OF_THE_SCAN = {
    "pose_jitter": "Errors of the Poses",
    "material_scale": "Brightness of the Material",
    "surface_variation": "Variation of the Surface",
}  # what every joint fit has
RED, BLUE, GREY = "#b4443c", "#2f6fb0", "#999"


def assessment_section(assessment: Assessment) -> str:
    """HTML, folded: everything that a scientist checks before relying on the causes."""
    parameters, calibration = assessment.parameters, assessment.calibration
    return (
        "<details><summary>Parameters, correlations and calibration of the joint fit</summary>"
        f"{_impacts(parameters)}{_pulls(parameters)}{_correlations(parameters)}"
        f"{_calibration(calibration)}{_sensor(assessment.sensor)}</details>"
    )


def _label(cause: str) -> str:
    return escape(OF_THE_SCAN.get(cause, cause_label(cause)))


def _impacts(parameters: JointParameters) -> str:
    rows = "".join(
        f"<tr><th>{_label(cause)}</th><td>{100 * impact:.2f} %</td></tr>"
        for cause, impact in parameters.ranked
    )
    return (
        "<h3>Impact on the BRDF</h3><p class='sub'>RMS change of the BRDF in the directions that "
        "the photos show, if the effect is off by one standard error.</p>"
        f"<table>{rows}</table>"
    )


def _pulls(parameters: JointParameters) -> str:
    each = sorted(
        zip(
            parameters.cause, parameters.name, parameters.estimate, parameters.error,
            parameters.prior, parameters.pull, strict=True,
        ),
        key=lambda row: -abs(row[-1]),
    )  # fmt: skip
    rows = "".join(
        f"<tr><th>{_label(cause)}</th><td>{escape(name)}</td><td>{x:.3g} ± {error:.2g}</td>"
        f"<td>{prior:.2g}</td><td>{pull:+.2f}</td></tr>"
        for cause, name, x, error, prior, pull in each
    )
    return (
        "<h3>Parameters</h3><p class='sub'>Pull: the estimate in units of the standard deviation "
        "of its prior, largest first. Errors of the scan are part of every fit.</p>"
        "<table><tr><th>Effect</th><th>Parameter</th><th>Estimate ± "
        "standard error</th><th>Standard deviation of the prior</th><th>Pull</th></tr>"
        f"{rows}</table>"
    )


def _correlations(parameters: JointParameters) -> str:
    pairs = "".join(
        f"<li>{_label(one)} and {_label(other)}: {correlation:.2f}</li>"
        for one, other, correlation in parameters.confusable
    )
    sentence = (
        f"<p>The photos hardly distinguish these effects (correlation above {CONFUSABLE:g}):</p>"
        f"<ul>{pairs}</ul>"
        if pairs
        else f"<p>No two effects have a correlation above {CONFUSABLE:g}.</p>"
    )
    return f"<h3>Correlations</h3>{sentence}{_matrix(parameters)}"


def _matrix(parameters: JointParameters) -> str:
    count = len(parameters.name)
    if not 1 < count <= MAX_MATRIX:
        return ""
    cells = "".join(
        _cell(column, row, parameters.correlation[row, column], 1.0, _pair(parameters, row, column))
        for row in range(count)
        for column in range(count)
        if row != column
    )
    return svg_element(count * CELL, count * CELL, "Correlation of all parameters", cells)


def _pair(parameters: JointParameters, row: int, column: int) -> str:
    both = (f"{_label(parameters.cause[k])}: {escape(parameters.name[k])}" for k in (row, column))
    return f"{' and '.join(both)}: {parameters.correlation[row, column]:+.2f}"


def _calibration(calibration: Calibration) -> str:
    bins = len(calibration.density)
    most = max(2.0, float(calibration.density.max()), float(calibration.high.max()))
    step = (WIDTH - LEFT) / bins

    def y(density: float) -> float:
        return TOP + (1 - max(density, 0.0) / most) * (HEIGHT - TOP - BOTTOM)

    drawn = ""
    for k, density in enumerate(calibration.density):
        x, within = LEFT + k * step, calibration.low[k] <= density <= calibration.high[k]
        low, high = y(float(calibration.low[k])), y(float(calibration.high[k]))
        drawn += (
            f"<rect x='{x:.1f}' y='{high:.1f}' width='{step:.1f}' height='{low - high:.1f}' "
            f"fill='{GREY}' fill-opacity='.35'/><rect x='{x + 2:.1f}' y='{y(float(density)):.1f}' "
            f"width='{step - 4:.1f}' height='{y(0) - y(float(density)):.1f}' "
            f"fill='{BLUE if within else RED}' fill-opacity='.8'/>"
        )
    drawn += "".join(
        f"<text x='{LEFT - 4}' y='{y(v) + 4:.1f}' text-anchor='end'>{v:g}</text>" for v in (0, 1)
    )
    drawn += (
        f"<text x='{LEFT}' y='{HEIGHT - 4}'>0</text><text x='{WIDTH}' y='{HEIGHT - 4}' "
        "text-anchor='end'>1</text>"
    )
    inside = "inside" if calibration.is_calibrated else "not inside"
    return (
        "<h3>Calibration</h3><p class='sub'>Histogram of the probability that the prediction of a "
        "held-out region gave to a smaller value. Flat if the stated errors are right; high at "
        f"both ends if they are too small. Grey: {100 * CONFIDENCE:.0f} % band of a flat "
        "histogram; red bars are outside it.</p>"
        f"{svg_element(WIDTH, HEIGHT, 'Histogram of the probability integral transform', drawn)}"
        f"<p>The histogram is {inside} the band. {100 * calibration.covered:.0f} % of the held-out "
        f"values are inside the {100 * INTERVAL:.0f} % interval.</p>"
    )


def _sensor(sensor: SensorResiduals) -> str:
    down, across = sensor.mean.shape
    cells = "".join(
        _cell(
            column, row, -float(sensor.mean[row, column]), FULL_RESIDUAL,
            f"{-100 * sensor.mean[row, column]:+.1f} ± {100 * sensor.error[row, column]:.1f} %",
        )
        for row, column in np.argwhere(np.isfinite(sensor.mean))
    )  # fmt: skip
    frame = (
        f"<rect x='0' y='0' width='{across * CELL}' height='{down * CELL}' fill='none' "
        f"stroke='{GREY}'/>"
    )
    return (
        "<h3>Residuals on the sensor</h3><p class='sub'>Prediction minus photo, mean over all "
        f"photos at each place of the sensor. Red: the prediction is too bright, blue: too dark; "
        f"full colour: {100 * FULL_RESIDUAL:.0f} %. Beyond two standard errors: "
        f"{100 * sensor.significant:.0f} % of the cells.</p>"
        f"{svg_element(across * CELL, down * CELL, 'Mean residual on the sensor', frame + cells)}"
    )


def _cell(column: int, row: int, value: float, full: float, title: str) -> str:
    strength = min(abs(value) / full, 1.0)
    return (
        f"<rect x='{column * CELL}' y='{row * CELL}' width='{CELL}' height='{CELL}' "
        f"fill='{RED if value > 0 else BLUE}' fill-opacity='{strength:.2f}'>"
        f"<title>{title}</title></rect>"
    )
