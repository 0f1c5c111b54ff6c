"""The verdict, and how much can be explained, by what the parts of a diagnosis answer is left."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from test_procedure_by_hand import STANDARD
from told_diagnosis import FINE, name_of, run_diagnosis

from smartshoe.diagnosis import _procedure
from smartshoe.diagnosis._held_out import Errors


def test_what_is_off_elsewhere_is_held_against_what_was_fitted_at_the_same_rate(parts: Any) -> None:
    """A hum stands in both; thinned, it stands in neither."""
    for parts.beyond, within in ((0.0, 0.07), (0.09, 0.09)):
        parts.seen.clear()
        run_diagnosis(parts)
        assert parts.seen["held_out_excess"][0] == ([FINE], ["fine 2"], within, STANDARD)


def test_where_nothing_can_be_tested_what_is_not_shown_to_be_noise_is_not_explained(parts: Any) -> None:
    """However little of it stands out: one load cycle repeats nothing."""
    parts.found.can_validate = False
    for kind in parts.kinds:
        kind.significant, kind.rms = False, 0.0
    for unproven, verdict in ((0.0, "adequate"), (0.004, "unexplained")):
        parts.seen.clear()
        parts.unproven = unproven
        assert run_diagnosis(parts).verdict == verdict
        sessions, residuals, left, thresholds, known, before = parts.seen["untested_rms"][0]
        assert before is None
        assert (sessions, residuals) == ([FINE], ["fine 2"])  # at full rate
        assert (left is parts.kinds[1], thresholds, known) == (True, STANDARD, 0.0)
        assert parts.seen["unexplained_remark"][0][1:3] == (0.0, unproven)


@pytest.mark.parametrize(
    ("cycles", "after", "material", "verdict"),
    [
        (30, 0.1, None, "unexplained"), (30, 0.1, 0.5, "adequate"),  # as much counts for nothing
        (30, 0.199998, None, "adequate"),  # hardly any
        (2, 0.1, None, "adequate"),  # by chance, as far as is known
    ],
)  # fmt: skip
def test_what_the_extended_model_does_away_with_for_certain_is_not_good_enough_without_it(
    parts: Any, monkeypatch: pytest.MonkeyPatch, cycles: int, after: float, material: float | None, verdict: str
) -> None:
    """Pieces of a few seconds repeat nothing, so that no test of what is left finds it."""
    for kind in parts.kinds:
        kind.significant, kind.rms = False, 0.0
    counts = np.full(cycles, 100.0)
    of = {False: Errors(0.2**2 * counts, counts, 0.4), True: Errors(after**2 * counts, counts, 0.4)}
    monkeypatch.setattr(_procedure, "errors", lambda fine, model: of[bool(model.parts)])
    parts.given.thresholds = STANDARD if material is None else replace(STANDARD, material=material)
    assert run_diagnosis(parts, parts.given.thresholds).verdict == verdict


def test_a_simulation_is_not_good_enough_where_no_test_would_show_what_is_left(parts: Any) -> None:
    """Two cycles that can be left out in turn, and too few to tell noise; beside causes it is weighed by what was."""
    for kind in parts.kinds:
        kind.significant, kind.rms = False, 0.0
    parts.unproven = 0.004
    for is_tested, names, verdict in (
        (True, [], "adequate"), (False, [], "unexplained"), (True, [name_of("linear_leak")], "explained"),
        (False, [name_of("linear_leak")], "partly_explained"),
    ):  # fmt: skip
        parts.seen.clear()
        parts.kinds[1].is_tested, parts.names = is_tested, names
        assert run_diagnosis(parts).verdict == verdict
        if not is_tested:
            before = parts.seen["untested_rms"][0][5]
            assert before == (["fine 0"] if names else None)  # what the plain model leaves


def test_what_an_effect_without_a_name_moves_is_not_explained(parts: Any) -> None:
    for size, verdict in ((STANDARD.tolerable, "explained"), (1.01 * STANDARD.tolerable, "partly_explained")):
        parts.seen.clear()
        parts.names = [name_of("linear_leak"), name_of("turned", size=size)]
        assert run_diagnosis(parts).verdict == verdict


def test_what_nothing_names_is_unexplained_and_says_where_it_lies(parts: Any) -> None:
    told = run_diagnosis(parts)
    assert (told.verdict, told.leftover, told.causes) == ("unexplained", "here", ())
    assert [one.effect for one in told.rivals] == ["delay", "linear_leak", "dead_band", "rate_gain"]  # no block is one
    assert [one.margin for one in told.rivals] == [0.0, 2.0, 3.0, 4.0]
    assert told.minor == ("linear_leak", "delay")
    assert parts.seen["noise_with_memory"][0][3] is False
    parts.seen.clear()
    parts.kinds[1].is_noise = True
    run_diagnosis(parts)
    assert parts.seen["noise_with_memory"][0][3] is True


def test_what_hides_in_noise_is_not_left(parts: Any) -> None:
    parts.kinds[1].significant, parts.kinds[1].rms = False, 0.0
    told = run_diagnosis(parts)  # what effects without a name did away with is not explained
    assert (told.verdict, told.leftover) == ("unexplained", "here")
    assert parts.seen["next_experiment"][1] == {"open_": True, "worse": False}
    parts.seen.clear()
    parts.kinds[0].significant, parts.kinds[0].rms = False, 0.0
    told = run_diagnosis(parts)
    assert (told.verdict, told.leftover) == ("adequate", None)
    assert told.explainable_percent == pytest.approx(100.0 * (1.0 - (0.05**2 - 0.01**2) / 0.04))
    assert parts.seen["next_experiment"][1] == {"open_": False, "worse": False}
    assert parts.seen["noise_with_memory"][0][3] is True


def test_where_a_kind_has_no_law_or_none_is_sure_no_more_than_what_is_tolerable_may_be_left(parts: Any) -> None:
    for kind_only, is_sure, other, verdict in (
        (False, True, True, "explained"),
        (False, False, True, "explained"),  # what is left is of the one that is sure
        (False, False, False, "partly_explained"),
        (True, True, True, "partly_explained"),
    ):
        parts.seen.clear()
        parts.names = [name_of("linear_leak", is_sure=other), name_of("delay", kind_only, is_sure=is_sure)]
        told = run_diagnosis(parts)
        assert (told.verdict, told.leftover is None) == (verdict, verdict == "explained")


def test_there_is_no_less_noise_than_none_and_no_more_than_the_error(parts: Any) -> None:
    parts.kinds[2].rms = 0.5  # more structure than is left
    assert run_diagnosis(parts).explainable_percent == 100.0
    parts.seen.clear()
    parts.kinds[2].rms, parts.off = 0.0, 0.5  # more than is judged, of which 0.02 is structure
    assert run_diagnosis(parts).explainable_percent == pytest.approx(100.0 * (1.0 - (0.01 - 0.02**2) / 0.04))


def test_what_a_model_does_not_foresee_elsewhere_is_no_noise(parts: Any) -> None:
    """What was fitted is off by 0.02, what is held out by 0.1, of which tests without a model show but 0.03."""
    parts.kinds[1].rms, parts.kinds[2].rms, parts.off = 0.03, 0.0, 0.02
    assert run_diagnosis(parts).explainable_percent == pytest.approx(100.0 * (1.0 - 0.02**2 / 0.04))


@pytest.mark.parametrize("judged", [0.0, 0.015])
def test_no_more_can_be_explained_than_is_left_beyond_noise_where_it_is_judged(parts: Any, judged: float) -> None:
    """What is white where it is judged is noise, whatever was fitted holds, and whether it is shown to be noise."""
    parts.judged = judged
    for can_validate, unproven in ((True, 0.0), (False, 0.05)):
        parts.seen.clear()
        parts.found.can_validate, parts.unproven = can_validate, unproven
        told = run_diagnosis(parts)
        assert told.explainable_percent == pytest.approx(100.0 * (1.0 - (0.01 - judged**2) / 0.04))
        sessions, residuals, thresholds = parts.seen["held_out_rms"][0]
        assert (sessions, residuals, thresholds) == ([FINE], ["fine 2"], STANDARD)  # at full rate
    parts.seen.clear()
    parts.judged = 1.0
    told = run_diagnosis(parts)  # nothing shows that any of it is noise
    assert told.explainable_percent == 100.0
