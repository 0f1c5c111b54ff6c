"""A drawing of the insoles from above: outlines, peaks of the units, and the path of the centre of pressure."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup

from smartshoe.arrays import Array
from smartshoe.gait import FootSeries, GaitResult
from smartshoe.gait.insole import OUTLINE, PLACES
from smartshoe.report.gait.strides import main_strides
from smartshoe.report.numbers import plain

MIDDLE = {"left": -0.23, "right": 0.23}  # position of each insole's axis, in insole lengths to the right
INWARDS = {"left": 1.0, "right": -1.0}
PATH_POINTS = 45
SIZE = 100.0  # length of an insole in the drawing
WIDE, HIGH = 96.0, 110.0


def placed(foot: str, centre: Array) -> Array:
    """Convert centres of pressure (n, 2), along and medial, to points of the drawing (n, 2) in insole lengths."""
    return np.column_stack([MIDDLE[foot] + INWARDS[foot] * centre[:, 1], centre[:, 0]])


def paths_of(found: GaitResult, foot: FootSeries) -> tuple[list[Array], Array]:
    """The path of the centre of pressure in each stance, and their mean (`PATH_POINTS`, 2), at 2 to 98 % of stance."""
    strides = main_strides(found, foot.name)
    if not strides:
        return [], np.zeros((0, 2))
    start, end = (np.array([[getattr(stride, name)] for stride in strides]) for name in ("start_s", "toe_off_s"))
    at = start + np.linspace(0.02, 0.98, PATH_POINTS) * (end - start)
    known = np.isfinite(foot.centre[:, 0])
    paths = np.stack([np.interp(at, foot.time_s[known], foot.centre[known, way]) for way in range(2)], axis=-1)
    return list(paths), paths.mean(axis=0)


def _points(points: Array) -> Array:
    """Convert points in insole lengths, y upwards, to the drawing's units, y downwards."""
    return np.column_stack([WIDE / 2 + SIZE * points[:, 0], HIGH - 5 - SIZE * points[:, 1]])


def _outline(foot: str) -> str:
    points = _points(np.array([(MIDDLE[foot] + INWARDS[foot] * medial, along) for along, medial in OUTLINE]))
    slope = (np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0)) / 6.0
    # A Catmull-Rom curve through the points, as cubic Bézier segments.
    pieces = [f"M{points[0][0]:.1f},{points[0][1]:.1f}"]
    for k in range(len(points)):
        n = (k + 1) % len(points)
        corners = (points[k] + slope[k], points[n] - slope[n], points[n])
        pieces.append("C" + " ".join(f"{x:.1f},{y:.1f}" for x, y in corners))
    return "".join(pieces) + "Z"


def _foot(found: GaitResult, foot: FootSeries) -> Markup:
    drawn = [Markup('<path class="sole" d="{}"/>').format(_outline(foot.name))]
    peaks = foot.usual_peak
    share = peaks / max(float(peaks.max()), 1e-12)
    spots = _points(placed(foot.name, np.array([PLACES[region] for region in foot.regions])))
    for region, (x, y), part in zip(foot.regions, spots, share, strict=True):
        radius = SIZE * (0.015 + 0.03 * float(np.sqrt(max(part, 0.0))))
        drawn.append(
            Markup('<circle cx="{:.1f}" cy="{:.1f}" r="{:.1f}" style="fill:var(--{})"/>').format(x, y, radius, region)
        )
    _, mean = paths_of(found, foot)
    if len(mean):
        points = _points(placed(foot.name, mean))
        text = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        drawn.append(Markup('<polyline class="path" points="{}"/>').format(text))
        drawn.append(Markup('<circle class="begin" cx="{:.1f}" cy="{:.1f}" r="1.6"/>').format(*points[0]))
    outward = -INWARDS[foot.name]
    outside, anchor = WIDE / 2 + SIZE * (MIDDLE[foot.name] + 0.19 * outward), "end" if outward < 0 else "start"
    for region, (_, y), peak in zip(foot.regions, spots, peaks, strict=True):
        unit = "N" if foot.is_force else foot.symbol
        drawn.append(
            Markup('<text x="{:.1f}" y="{:.1f}" text-anchor="{}">{} {} {}</text>').format(
                outside, y + 1.3, anchor, region, plain(float(peak)), unit
            )
        )
    return Markup("").join(drawn)


def insoles(found: GaitResult) -> Markup:
    """Both insoles with the units' usual peaks and each foot's mean path of the centre of pressure."""
    feet = Markup("").join(_foot(found, foot) for foot in found.feet.values())
    return Markup(
        '<svg class="soles" viewBox="-36 0 168 110" role="img" aria-label="Insoles seen from above, with each unit\'s'
        ' usual peak and the mean path of the centre of pressure, from heel strike (dot) to toe off.">{}</svg>'
    ).format(feet)
