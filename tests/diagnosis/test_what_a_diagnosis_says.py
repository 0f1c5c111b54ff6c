"""A diagnosis as JSON, table, figure and calibration: by made findings, whose every number is known."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from smartshoe.diagnosis import Thresholds
from smartshoe.diagnosis._held_out import Gain
from smartshoe.diagnosis._result import Cause, Diagnosis, GoodnessOfFit, NextExperiment, Rival, Statement, Trace
from smartshoe.errors import InputError, NotIdentifiableError
from smartshoe.integrity import DataFault
from smartshoe.models import Parameter
from smartshoe.models.effects import effect
from smartshoe.models.extended import ExtendedModel

CAUSE = Cause(
    effect("linear_leak"),
    confidence=0.93,
    law_confidence=0.7,
    equivalents=("orifice_leak",),
    parameters={"leak_rate": Parameter(0.02, 0.001, (0.018, 0.022), "1/s")},
    evidence=(Statement("gain", 66.0, -np.inf, "It follows."),),
    held_out=Gain(1.2, 0.4, "mbar", 66.0, (60.0, 71.0)),
    size=0.013,
)
TIME_S = 0.1 * np.arange(5, dtype=np.float64)
TRACE = Trace(
    "run_1", TIME_S, 100.0 * TIME_S, 10.0 + TIME_S, np.full(5, 9.0), np.full(5, 10.0),
    np.array([True, True, False, True, True]), np.zeros(5, dtype=bool), np.zeros(5, dtype=np.intp), 0,
)  # fmt: skip
FOUND = Diagnosis(
    "explained",
    "A leak.",
    "mbar",
    800.0,
    140.0,
    causes=(CAUSE,),
    minor=("hum",),
    baseline=GoodnessOfFit(1.2, "mbar", 90.0, np.nan, 0.5, 40.0),
    extended=GoodnessOfFit(0.4, "mbar", 97.0, 2.0, 0.1),
    gain=Gain(1.2, 0.4, "mbar", 66.0, (60.0, 71.0)),
    explainable_percent=92.0,
    explained_percent=90.5,
    rivals=(Rival("zero_drift", 12.0), Rival("creep", np.inf)),
    next_experiment=NextExperiment(("linear_leak", "orifice_leak"), "long_hold", None, "Hold it.", 5.0),
    limits=("one rate",),
    screening=(("linear_leak", 300.0),),
    model=ExtendedModel(1.0, 0.08, 0.22, 800.0, 140.0, "mbar"),
    traces=(TRACE,),
    thresholds=Thresholds(),
)


def test_json_holds_what_the_contract_names_and_no_number_that_json_has_not() -> None:
    told = json.loads(json.dumps(FOUND.to_dict(), allow_nan=False))
    (cause,) = told["causes"]
    assert (cause["effect"], cause["family"], cause["stage"]) == ("linear_leak", "leak", CAUSE.effect.stage)
    assert (cause["confidence"], cause["law_confidence"], cause["equivalents"]) == (0.93, 0.7, ["orifice_leak"])
    assert cause["parameters"] == {"leak_rate": {"value": 0.02, "ci95": [0.018, 0.022], "unit": "1/s"}}
    assert cause["evidence"] == [{"statistic": "gain", "value": 66.0, "threshold": None, "says": "It follows."}]
    assert cause["held_out"] == told["held_out"]
    assert told["held_out"] == {
        "rmse_before": 1.2, "rmse_after": 0.4, "unit": "mbar", "gain_percent": 66.0, "ci95": [60.0, 71.0]
    }  # fmt: skip
    assert cause["size_percent_of_full_scale"] == pytest.approx(1.3)
    assert told["baseline"] == {
        "rmse": {"value": 1.2, "unit": "mbar"}, "fit_percent": 90.0, "force_rmse_n": None,
        "structure_rms": {"value": 0.5, "unit": "mbar"}, "variance_explained_percent": 40.0,
    }  # fmt: skip
    assert (told["extended"]["force_rmse_n"], told["extended"]["variance_explained_percent"]) == (2.0, 0.0)
    assert (told["explainable_percent"], told["explained_percent"]) == (92.0, 90.5)
    assert told["rivals"] == [
        {"effect": "zero_drift", "margin": 12.0, "by": "evidence"},
        {"effect": "creep", "margin": None, "by": "evidence"},
    ]
    assert told["next_experiment"] == {
        "separates": ["linear_leak", "orifice_leak"], "protocol": "long_hold", "channel": None, "says": "Hold it.",
        "expected_margin": 5.0,
    }  # fmt: skip
    assert told["screening"] == [{"effect": "linear_leak", "fall": 300.0}]
    assert (told["minor_effects"], told["limits"], told["leftover"]) == (["hum"], ["one rate"], None)
    assert told["model"] == json.loads(json.dumps(FOUND.model.to_dict()))  # type: ignore[union-attr]


def test_json_of_a_refusal_has_the_same_names() -> None:
    refused = Diagnosis("refused", "No load.", "mbar", 0.0, 0.0, limits=("no reference load",))
    told = json.loads(json.dumps(refused.to_dict(), allow_nan=False))
    assert told.keys() == FOUND.to_dict().keys()
    nothing: dict[str, object] = {"rmse": {}, "fit_percent": None, "force_rmse_n": None}
    assert (told["baseline"], told["extended"]) == (nothing, nothing)
    assert (told["held_out"], told["next_experiment"], told["model"]) == (None, None, None)
    unknown = replace(FOUND.next_experiment, expected_margin=None)  # type: ignore[type-var]
    assert unknown.to_dict()["expected_margin"] is None  # type: ignore[union-attr]
    for asked in (refused.calibration, refused.plot):
        with pytest.raises(NotIdentifiableError, match="No load"):
            asked()


def test_a_calibration_is_of_the_load_that_was_seen() -> None:
    made = FOUND.calibration(unit="heel", created="2026-01-02")
    assert (made.unit, made.created, made.load_range_n) == ("heel", "2026-01-02", (0.0, 800.0))


def test_a_calibration_runs_at_the_rate_of_the_recordings_where_no_other_is_given() -> None:
    recorded_hz = 1.0 / float(TIME_S[1] - TIME_S[0])
    assert FOUND.calibration().sample_rate_hz == FOUND.calibration().compensator().sample_rate_hz
    assert FOUND.calibration().sample_rate_hz == pytest.approx(recorded_hz, rel=1e-8)
    assert FOUND.calibration(sample_rate_hz=250.0).sample_rate_hz == 250.0


def test_a_figure_shows_what_both_models_leave_where_the_reading_counts() -> None:
    pytest.importorskip("matplotlib")
    from matplotlib import pyplot

    figure = FOUND.plot()
    axis = figure.axes[0]
    assert (axis.get_title(), axis.get_ylabel()) == ("run_1", "measured minus model (mbar)")
    for line, simulated in zip(axis.lines, (9.0, 10.0), strict=True):
        expected = np.where(TRACE.usable, TRACE.reading - simulated, np.nan)
        assert np.asarray(line.get_ydata(), dtype=float) == pytest.approx(expected, nan_ok=True)
    assert [line.get_label() for line in axis.lines] == ["baseline", "extended"]
    assert axis.get_legend() is not None
    pyplot.close(figure)


def test_a_summary_tells_each_cause_in_percent() -> None:
    text = FOUND.summary()
    for word in ("explained", "A leak.", "linear leak", "93 %", "1.3", "66", "one rate"):
        assert word in text
    surest = replace(FOUND.causes[0], confidence=0.9954, equivalents=("orifice_leak",))
    told = replace(FOUND, causes=(surest,)).summary()
    assert "over 99 %" in told  # as anywhere: what is meant may be another, and nothing is certain
    assert "orifice leak" in told


def test_a_summary_tells_what_the_command_tells_beside_the_causes() -> None:
    hum = DataFault("held_samples", 0, "run_1.csv", 0.0, 9.0, 0.1, "three samples in ten are held")
    repeat = NextExperiment((), "repeat", None, "repeat the load cycle")
    told = replace(FOUND, data_faults=(hum,), leftover="a third lies in holds", next_experiment=repeat).summary()
    for line in (
        "fault of the data: held samples, run_1.csv: three samples in ten are held",
        "in the extended model without being causes, too small, too unsure or without a law: hum",
        "what is left: a third lies in holds",
        *(f"limit: {limit}" for limit in FOUND.limits),
        "next: repeat the load cycle",
    ):
        assert line in told.splitlines()
    assert "in the rejected model without being causes" in replace(FOUND, rejected=FOUND.model).summary()
    bare = replace(FOUND, data_faults=(), leftover=None, next_experiment=None, limits=(), minor=()).summary()
    assert not any(word in bare for word in ("fault of", "without being", "what is left", "limit: ", "next: "))


def test_the_unit_of_a_calibration_is_text() -> None:
    with pytest.raises(InputError, match="unit is 5: give the unit's name as text"):
        FOUND.calibration(unit=5)  # type: ignore[arg-type]
