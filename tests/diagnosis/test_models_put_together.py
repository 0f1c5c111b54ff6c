"""Which model a diagnosis offers and a calibration undoes, and what is said of its force, by what the parts answer."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest
from test_procedure_by_hand import BEFORE, MODEL, STANDARD
from told_diagnosis import EXTENDED_N, FILTER, FINE, PLAIN_N, SCALE, name_of, run_diagnosis

from smartshoe.diagnosis import _force, _procedure
from smartshoe.diagnosis._force import Compensation, ForceError


@pytest.mark.parametrize(("after", "is_rejected"), [(1.001, True), (1.0, False)])
def test_an_extension_that_is_worse_where_it_is_judged_is_not_adopted(
    parts: Any, monkeypatch: pytest.MonkeyPatch, after: float, is_rejected: bool
) -> None:
    """It is still told, with its causes and what it would do; what is offered is the plain model's."""
    parts.names = [name_of("linear_leak")]
    best = replace(BEFORE, squares=after**2 * BEFORE.squares)
    monkeypatch.setattr(_procedure, "errors", lambda _, model: best if model.parts else BEFORE)
    monkeypatch.setattr(_procedure, "loads_beyond_fit", lambda *_: None)
    told = run_diagnosis(parts)
    assert [one.name for one in told.causes] == ["linear_leak"]
    assert told.gain.rmse_after == pytest.approx(after * told.gain.rmse_before)
    assert told.extended.rmse == pytest.approx(told.baseline.rmse)
    extended = parts.found.fit.model.names
    offered = () if is_rejected else extended
    assert parts.seen["_with_offset"][0][0].names == parts.seen["compensation"][0][1].names == offered
    assert (told.rejected.names if told.rejected else None) == (extended if is_rejected else None)
    assert parts.seen["joint_parameters"][0][0] is (parts.found.baseline if is_rejected else parts.found.fit)
    assert any("; it is rejected" in said for said in told.limits) is is_rejected
    assert told.explained_percent == 0.0
    assert told.extended.structure_rms == pytest.approx(42.0 if is_rejected else 2.8)
    assert parts.seen["unexplained_remark"][0][0] is parts.kinds[0 if is_rejected else 1]  # of what is handed out


def test_a_calibration_compensates_by_the_model_that_gives_back_the_load_of_what_was_fitted(
    parts: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert run_diagnosis(parts).force_model is None
    parts.seen.clear()
    by_plain = Compensation(
        [FINE], MODEL, PLAIN_N, PLAIN_N, ForceError(8.2, 7.0), FILTER, ("linear_leak", "delay"), is_plain=True
    )
    monkeypatch.setattr(_procedure, "compensation", lambda *_: by_plain)
    told = run_diagnosis(parts)
    assert told.force_model == "with offset"
    assert parts.seen["_with_offset"][0][0] is MODEL  # the plain one's
    assert told.extended.force_rmse_n == 9.0
    assert any("the calibration corrects by the baseline; its twin" in limit for limit in told.limits)


@pytest.mark.parametrize(("apart", "has_own"), [(0.9, False), (1.1, True), (-1.1, True)])
def test_a_calibration_takes_the_zero_of_what_its_filter_undoes(
    parts: Any, monkeypatch: pytest.MonkeyPatch, apart: float, has_own: bool
) -> None:
    """Of what it does not, as a zero that goes with the room, the mean is the zero's."""
    late: Any = SimpleNamespace(not_inverted=("delay",), moved_by_the_clock={}, lags_left_s={})
    in_part = Compensation([FINE], MODEL.with_part("delay"), EXTENDED_N, PLAIN_N, EXTENDED_N, late)
    undone = in_part.undone
    assert undone.names == MODEL.names
    monkeypatch.setattr(_procedure, "compensation", lambda *_: in_part)
    zero = 0.01 + apart * STANDARD.material
    for room in (_procedure, _force):
        monkeypatch.setattr(room, "mean_offset", lambda _, model: zero if model is undone else 0.01)
    told = run_diagnosis(parts)
    assert told.force_model == ("with offset" if has_own else None)
    assert (parts.seen["_with_offset"][0][-1] is undone) == has_own
    assert parts.seen["limit_calibration_off"][0][0].zero == zero


def test_what_a_calibration_gives_of_the_same_recordings_is_said(parts: Any) -> None:
    parts.limit_calibration_off = ["by one zero"]
    assert run_diagnosis(parts).limits == ("limit", "by one zero")
    (force, thresholds), _ = parts.seen["limit_calibration_off"]
    assert (force.fine, thresholds) == ([FINE], STANDARD)
    assert force.model.names == parts.found.fit.model.names


def test_what_a_filter_would_make_of_spikes_is_said(parts: Any) -> None:
    parts.limit_unsound_readings = ["by spikes"]
    assert run_diagnosis(parts).limits == ("limit", "by spikes")
    (force, scale, thresholds), _ = parts.seen["limit_unsound_readings"]
    assert (force.fine, scale, thresholds) == ([FINE], SCALE, STANDARD)


def test_a_wall_as_no_wall_is_is_said_of_the_extended_model(parts: Any) -> None:
    parts.wall_ratio = ["no such wall"]
    assert run_diagnosis(parts).limits == ("limit", "no such wall")
    (model, sessions, thresholds), _ = parts.seen["limit_wall_ratio"]
    assert (model.names, model.noise) == (parts.found.fit.model.names, parts.off)  # what is left of the reading
    assert ([one.name for one in sessions], thresholds) == (["held", "fitted"], STANDARD)


def test_what_no_compensator_takes_off_is_said_of_the_extended_model(
    parts: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    parts.not_undone, parts.wall_ratio = ["not undone"], ["no such wall"]
    told = run_diagnosis(parts)
    assert told.limits == ("limit", "not undone", "no such wall")
    assert told.limits_of_the_force == ("not undone",)  # the wall is the model's
    parts.wall_ratio = []
    (model, step_s), _ = parts.seen["limit_not_undone"]
    assert model.names == parts.found.fit.model.names
    assert step_s == 0.05
    parts.seen.clear()
    by_plain = Compensation(
        [FINE], MODEL, PLAIN_N, PLAIN_N, ForceError(8.2, 7.0), FILTER, ("linear_leak", "delay"), is_plain=True
    )
    monkeypatch.setattr(_procedure, "compensation", lambda *_: by_plain)
    (_, said, why) = run_diagnosis(parts).limits
    assert "gives a worse force (error on the fitted data 8.2 N instead of 8 N by the baseline)" in said
    assert why == "not undone"  # and so is why: what a stream cannot undo is left in its force
    (model, _), _ = parts.seen["limit_not_undone"]
    assert model.names == parts.found.fit.model.names
