"""A trial's charts: mean stride, left and right, units, the whole trial, phases, and figures stride by stride."""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array
from smartshoe.gait import FootSeries, GaitResult
from smartshoe.gait.indices import POINTS, overlaid
from smartshoe.gait.membership import PHASES as MEMBERS
from smartshoe.gait.phases import PHASES
from smartshoe.gait.summary import of_main_activity
from smartshoe.report.charts import Chart, Line, Mark, Panel
from smartshoe.report.gait.strides import main_strides, whole_of
from smartshoe.report.numbers import plain
from smartshoe.signals.masks import runs_of

WEIGHT_FROM = {
    "given": "as given",
    "strides": "from strides",
    "standing": "from standing",
    "one_shoe": "from one shoe, counted twice",
}
PERCENT = np.linspace(0.0, 100.0, POINTS)
WINDOW_STRIDES = 5
PHASE_COLOURS = ("line", "heel", "corrected", "meta1")
MEMBER_COLOURS = ("heel", "left", "corrected", "meta1", "toe", "soft")


def _label(foot: FootSeries) -> str:
    return "vertical force (N)" if foot.force_n is not None else f"sum of readings ({foot.symbol})"


def _walked(found: GaitResult) -> list[FootSeries]:
    return [foot for foot in found.feet.values() if main_strides(found, foot.name)]


def _each(found: GaitResult, foot: FootSeries) -> Array:
    return overlaid(main_strides(found, foot.name), foot.time_s, whole_of(foot))


def _toe_off(found: GaitResult, foot: FootSeries) -> float:
    return float(np.mean([stride.stance_percent for stride in main_strides(found, foot.name)]))


def mean_strides(found: GaitResult) -> list[Chart]:
    """Each foot's mean stride with a band of one standard deviation, on a common scale."""
    feet = _walked(found)
    each = {foot.name: _each(found, foot) for foot in feet}
    top = max((float((rows.mean(axis=0) + rows.std(axis=0)).max()) for rows in each.values()), default=1.0)
    low = min((float((rows.mean(axis=0) - rows.std(axis=0)).min()) for rows in each.values()), default=0.0)
    charts = []
    for foot in feet:
        rows = each[foot.name]
        mean, sd = rows.mean(axis=0), rows.std(axis=0)
        toe_off = _toe_off(found, foot)
        unit = "N" if foot.force_n is not None else foot.symbol
        says = (
            f"{len(rows)} strides, mean and band of one sd. Highest {plain(float(mean.max()))} {unit}"
            f" at {PERCENT[int(mean.argmax())]:.0f} %, toe off at {toe_off:.0f} % (dashed)."
        )
        line = Line("mean", mean, foot.name, low=mean - sd, high=mean + sd)
        panel = Panel(_label(foot), [line], (min(0.0, low) - 0.02 * top, 1.05 * top), 260)
        charts.append(Chart(f"Mean stride, {foot.name}", says, "stride (%), from heel strike", PERCENT, [panel],
                            group="stride", marks=[Mark(toe_off, toe_off, "soft")]))  # fmt: skip
    return charts


def left_and_right(found: GaitResult) -> Chart | None:
    """The mean strides of both feet over each other, and their difference; None with one foot."""
    feet = _walked(found)
    if len(feet) < 2:
        return None
    means = [_each(found, foot).mean(axis=0) for foot in feet]
    apart = means[1] - means[0]
    at = int(np.abs(apart).argmax())
    share = 100 * float(np.abs(apart).max()) / max(float(np.max(means)), 1e-12)
    unit = "N" if feet[0].force_n is not None else feet[0].symbol
    says = (
        f"Furthest apart at {PERCENT[at]:.0f} % of the stride: {feet[1].name} less {feet[0].name} is"
        f" {plain(float(apart[at]), 2)} {unit}, {plain(share, 2)} % of the peak."
    )
    panels = [
        Panel(_label(feet[0]), [Line(feet[0].name, means[0], feet[0].name),
                                Line(feet[1].name, means[1], feet[1].name, "dashed")]),
        Panel(f"{feet[1].name} − {feet[0].name}", [Line("difference", apart, "load")], height=120),
    ]  # fmt: skip
    return Chart("Left beside right", says, "stride (%), each from its own heel strike", PERCENT, panels, "stride")


def units(found: GaitResult) -> list[Chart]:
    """The mean load of each unit over the stride, with bands; one chart for each foot."""
    charts = []
    for foot in _walked(found):
        rows = overlaid(main_strides(found, foot.name), foot.time_s, foot.load)
        mean, sd = rows.mean(axis=0), rows.std(axis=0)
        lines = [
            Line(region, mean[:, k], region, low=mean[:, k] - sd[:, k], high=mean[:, k] + sd[:, k])
            for k, region in enumerate(foot.regions)
        ]
        first = " then ".join(foot.regions[k] for k in np.argsort(mean.argmax(axis=0), kind="stable"))
        label = "load (N)" if foot.is_force else f"reading ({foot.symbol})"
        charts.append(Chart(f"Units, {foot.name}", f"Mean over strides, band of one sd; the peaks come {first}.",
                            "stride (%)", PERCENT, [Panel(label, lines)], group="stride"))  # fmt: skip
    return charts


def trial(found: GaitResult) -> Chart:
    """The whole trial over time: the force of each foot and of both, and body weight."""
    feet = list(found.feet.values())
    base = feet[0].time_s
    lines = [
        Line(foot.name, whole_of(foot) if foot is feet[0] else _on(base, foot.time_s, whole_of(foot)), foot.name)
        for foot in feet
    ]
    panels = [Panel(_label(feet[0]), lines)]
    says = "Show all zooms out; drag over a part to see it." if found.strides else "Drag over a part to see it."
    if found.total_n is not None:
        both = [Line("both feet", _on(base, found.total_time_s, found.total_n), "load")]
        weight = found.forces.body_weight
        if weight is not None:
            both.append(Line("body weight", np.full(base.size, weight.value), "corrected", "dashed"))
            says = f"Body weight {plain(weight.value, 4)} N, {WEIGHT_FROM[weight.source]}. {says}"
        panels.append(Panel("total force (N)", both))
    marks = [Mark(start, end, "corrected", "standing") for start, end in found.standing_s]
    return Chart("The trial", says, "time (s)", base, panels, marks=marks, window=some_strides(found))


def _on(base: Array, time_s: Array, values: Array) -> Array:
    return np.asarray(np.interp(base, time_s, values, left=np.nan, right=np.nan))


def some_strides(found: GaitResult) -> tuple[float, float] | None:
    """A time window that shows a few strides in the middle of the trial; None without strides."""
    own = of_main_activity(found.strides)
    if not own:
        return None
    middle = own[len(own) // 2]
    begin = middle.start_s - 0.1 * middle.time_s
    return begin, begin + WINDOW_STRIDES * middle.time_s


def phases(found: GaitResult) -> list[Chart]:
    """A few strides of each foot with their phases as bands."""
    window = some_strides(found)
    if window is None:
        return []
    begin, end = window
    charts = []
    for foot in found.feet.values():
        first, last = np.searchsorted(foot.time_s, [begin, end])
        time_s, state = foot.time_s[first:last], foot.state[first:last]
        if time_s.size < 2:
            continue
        marks = []
        for code in range(1, len(PHASES)):
            starts, stops = runs_of(state == code)
            marks += [
                Mark(float(time_s[a]), float(time_s[min(b, time_s.size - 1)]), PHASE_COLOURS[code], PHASES[code])
                for a, b in zip(starts, stops, strict=True)
            ]
        says = f"Bands: {', '.join(f'{name} ({colour})' for name, colour in _named())}; none is swing."
        line = Line(foot.name, whole_of(foot)[first:last], foot.name)
        charts.append(Chart(f"Phases, {foot.name}", says, "time (s)", time_s, [Panel(_label(foot), [line])],
                            group="phases", marks=marks))  # fmt: skip
    return charts


def _named() -> list[tuple[str, str]]:
    return list(zip(PHASES[1:], ("violet", "green", "ochre"), strict=True))


def memberships(found: GaitResult) -> list[Chart]:
    """Mean membership in the six phases over the stride, and the part that fits none of them."""
    charts = []
    for foot in _walked(found):
        own = main_strides(found, foot.name)
        mean = overlaid(own, foot.time_s, foot.membership).mean(axis=0)
        lines = [Line(name.replace("_", " "), mean[:, k], MEMBER_COLOURS[k]) for k, name in enumerate(MEMBERS)]
        lines.append(Line("abnormality", overlaid(own, foot.time_s, foot.abnormality).mean(axis=0), "bad", "dashed"))
        says = "From the four loads, mean over strides, after the idea of Kong and Tomizuka 2009; dashed fits no phase."
        charts.append(Chart(f"How much of each phase, {foot.name}", says, "stride (%)", PERCENT,
                            [Panel("membership", lines, (0.0, 1.02))], group="stride"))  # fmt: skip
    return charts


def variability(found: GaitResult) -> Chart | None:
    """Stride time and peak force, stride by stride; None if no foot has three strides."""
    feet = [foot for foot in _walked(found) if len(main_strides(found, foot.name)) > 2]
    if not feet:
        return None
    began = np.unique([stride.start_s for foot in feet for stride in main_strides(found, foot.name)])
    times: list[Line] = []
    peaks: list[Line] = []
    for foot in feet:
        own = main_strides(found, foot.name)
        at = np.searchsorted(began, [stride.start_s for stride in own])
        for lines, values in (
            (times, [stride.time_s for stride in own]),
            (peaks, [np.nan if stride.peak_n is None else stride.peak_n for stride in own]),
        ):
            row = np.full(began.size, np.nan)
            row[at] = values
            lines.append(Line(foot.name, row, foot.name, "points"))
    panels = [Panel("stride time (s)", times, height=140)]
    if all(foot.force_n is not None for foot in feet):
        panels.append(Panel("peak force (N)", peaks, height=140))
    return Chart("Stride by stride", "Each point is a stride.", "time (s)", began, panels)
