"""Diagnoses of every verdict, made by hand, and the pages of them."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from smartshoe.diagnosis import Cause, Diagnosis, Gain, GoodnessOfFit, Trace
from smartshoe.diagnosis._result import NextExperiment, Rival, Statement
from smartshoe.integrity import DataFault
from smartshoe.models.effects import Conditions, Effect, effect
from smartshoe.models.extended import ExtendedModel
from smartshoe.models.parameter import Parameter
from smartshoe.protocol import Protocol, Segment, dynamic_protocol
from smartshoe.report.diagnosis._page import write_diagnosis_page

NAME = '<script>alert("1")</script> & $x$'
FULL_LOAD_N, FULL_READING, STEP_S = 800.0, 70.0, 0.02
CASES = ("adequate", "one cause", "two causes", "partly_explained", "unexplained", "refused")
BASELINE = ExtendedModel(1.0, 0.12, 0.2, FULL_LOAD_N, FULL_READING, "mbar")


def _with(name: str, strength: float) -> tuple[Effect, np.ndarray]:
    """An effect with its first strength away from null."""
    one = effect(name)
    values = one.start()
    values[next(k for k, parameter in enumerate(one.parameters) if parameter.null is not None)] = strength
    return one, values


LEAK, PLAY = _with("linear_leak", 0.002), _with("play_hysteresis", 0.012)


def _load(peak_n: float) -> tuple[np.ndarray, np.ndarray]:
    triangles = dynamic_protocol((100.0, 400.0, 800.0), peak_n=peak_n, repeats=2, rest_s=3.0)
    held = (Segment("ramp", peak_n, 2.0), Segment("hold", peak_n, 20.0), Segment("ramp", 0.0, 2.0))
    whole = Protocol("both", (*triangles.segments, *held, Segment("rest", 0.0, 10.0)))
    time_s = np.arange(0.0, whole.duration_s, STEP_S)
    return time_s, whole.load_at(time_s)


@cache
def traces_of(parts: tuple[str, ...], found: tuple[str, ...], step_in_gain: float = 0.0) -> tuple[Trace, ...]:
    """Two recordings of a unit with ``parts``, of which the extended model knows those ``found``."""
    rng = np.random.default_rng(3)
    traces = []
    for index, peak_n in enumerate((800.0, 720.0)):
        time_s, load_n = _load(peak_n)
        conditions = Conditions(time_s, load_n / FULL_LOAD_N, STEP_S)
        truth, extended = BASELINE, BASELINE
        for name, (one, values) in (("leak", LEAK), ("play", PLAY)):
            truth = truth.with_part(one, values) if name in parts else truth
            extended = extended.with_part(one, values) if name in found else extended
        reading = truth.reading(conditions) * (1.0 + step_in_gain * (time_s > 30.0)) + rng.normal(0, 0.1, time_s.size)
        traces.append(
            Trace(
                f"triangles_{index + 1}",
                time_s,
                load_n,
                reading,
                BASELINE.reading(conditions),
                extended.reading(conditions),
                np.ones(time_s.size, dtype=bool),
                np.full(time_s.size, index == 1),
                np.minimum(time_s // 8, 11).astype(np.intp),
                index,
            )
        )
    return tuple(traces)


def _goodness(trace: Trace, simulated: np.ndarray, structure: float) -> GoodnessOfFit:
    rmse = float(np.sqrt(np.mean((trace.reading - simulated) ** 2)))
    return GoodnessOfFit(rmse, "mbar", 100 * (1 - rmse / float(np.std(trace.reading))), 12.3 * rmse, structure)


LEAK_CAUSE = Cause(
    LEAK[0],
    0.9931,
    1.0,
    (),
    {"leak_rate": Parameter.from_sd(0.002, 0.00003, "1/s")},
    (Statement("fall", 1234.0, 30.0, "without it the fit is worse by 1234 where 30 would do"),),
    Gain(0.8, 0.31, "mbar", 61.3, (55.0, 66.0)),
    0.011,
    (Rival("zero_drift", 88.0),),
)
PLAY_CAUSE = Cause(
    PLAY[0],
    0.95,
    0.62,
    ("bouc_wen_hysteresis",),
    {"half_height": Parameter.from_sd(9.6, 0.4, "N"), "width": Parameter.from_sd(80.0, math.nan, "N")},
    (Statement("fall", 321.0, 30.0, "without it the fit is worse by 321 where 30 would do"),),
    Gain(0.33, 0.31, "mbar", 6.1, (2.0, 9.0)),
    0.004,
    (Rival("bouc_wen_hysteresis", 1.7, "fit"), Rival("dead_band", 45.0)),
)
RUN_NEXT = (
    "run the protocol minor loops: it should tell play hysteresis and bouc wen hysteresis apart, which this data does"
    " not"
)
LOOPS = Protocol("minor_loops", (Segment("ramp", 400.0, 4.0), Segment("ramp", 200.0, 2.0), Segment("ramp", 0.0, 2.0)))
FAULTS = (
    DataFault("held_samples", 0, "triangles_1", 5.0, 5.6, 0.02, "a value repeats while the load moves", "material"),
    DataFault("spikes", 1, "triangles_2", 40.0, 40.02, 1e-5, "one sample stands alone", "minor"),
)
SCREENING = (("linear_leak", 5000.0), ("zero_drift", 4900.0), ("play_hysteresis", 310.0), ("delay", 0.0))
LIKENESS = np.array([[1, 0.99, 0.2, 0.1], [0.99, 1, 0.2, 0.1], [0.2, 0.2, 1, 0.5], [0.1, 0.1, 0.5, math.nan]])


def case(name: str) -> Diagnosis:
    """A diagnosis made by hand, one for each verdict and for one and two causes."""
    if name == "refused":
        reason = "triangles_1: there is no reference load: name it with --force"
        return Diagnosis(
            "refused", f"no diagnosis: {reason}", "mbar", 0.0, 0.0, data_faults=FAULTS[:1], limits=(reason,)
        )
    both = ("leak", "play")
    traces = {
        "adequate": lambda: traces_of((), ()),
        "one cause": lambda: traces_of(("leak",), ("leak",)),
        "two causes": lambda: traces_of(both, both),
        "partly_explained": lambda: traces_of(both, ("leak",)),
        "unexplained": lambda: traces_of((), (), 0.02),
    }[name]()
    judged = traces[-1]
    causes = {"one cause": (LEAK_CAUSE,), "two causes": (LEAK_CAUSE, PLAY_CAUSE), "partly_explained": (LEAK_CAUSE,)}
    left = "70 % of the power that is left lies at 50-75 % of full load while unloading"
    made = Diagnosis(
        "explained" if "cause" in name else name,  # type: ignore[arg-type]
        f"the verdict on {name}",
        "mbar",
        FULL_LOAD_N,
        FULL_READING,
        causes=causes.get(name, ()),
        minor=("sensor_lag",) if name == "two causes" else (),
        data_faults=FAULTS if name in ("two causes", "partly_explained") else (),
        baseline=_goodness(judged, judged.baseline, 0.0 if name == "adequate" else 0.7),
        extended=_goodness(judged, judged.extended, 0.2 if name == "partly_explained" else 0.0),
        gain=Gain(0.9, 0.2, "mbar", 77.7, (70.0, 80.0)),
        explainable_percent=3.0 if name == "adequate" else 92.0,
        explained_percent={"adequate": 0.4, "unexplained": 0.0, "partly_explained": 61.0}.get(name, 90.5),
        rivals=(Rival("zero_drift", 88.0),),
        limits=("one loading rate only: nothing can be said of rate dependence",) if name == "one cause" else (),
        leftover=left if name in ("partly_explained", "unexplained") else None,
        screening=SCREENING,
        likeness=LIKENESS,
        traces=traces,
    )
    if name != "two causes":
        return made
    pair = ("play_hysteresis", "bouc_wen_hysteresis")
    return replace(made, next_experiment=NextExperiment(pair, "minor_loops", None, RUN_NEXT, 35.2, LOOPS))


@cache
def page(name: str) -> str:
    """The page's text, written once a case."""
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        path = write_diagnosis_page(Path(folder) / "diagnosis.html", case(name), "Diagnosis", {"fitted": "a"}, "x.toml")
        return path.read_text(encoding="utf-8")


def plain_text(html: str) -> str:
    """What a person reads: no tags, no style, spaces as one."""
    import html as escapes

    kept = re.sub(r"<style.*?</style>|<script.*?</script>|<!--.*?-->", "", html, flags=re.DOTALL)
    return " ".join(escapes.unescape(re.sub(r"<[^>]+>", " ", kept)).split())
