"""A diagnosis put together from what each of its parts answers."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from test_procedure_by_hand import AFTER, BEFORE, MODEL, STANDARD
from told_diagnosis import FAULT, name_of, run_diagnosis

from smartshoe.diagnosis._zero import Zero
from smartshoe.models.effects import shift_of


def test_a_diagnosis_is_put_together_from_its_parts(parts: Any) -> None:
    parts.names = [name_of("linear_leak"), name_of("turned", size=STANDARD.tolerable), name_of("delay")]
    parts.zeros = [Zero(shift_of("load"), 0.2, 0.1, 0.2), Zero(shift_of("reading"), 0.2, 0.1, 1e-4)]
    told = run_diagnosis(parts)
    assert [one.name for one in told.causes] == ["delay", "zero", "linear_leak"]  # the largest first, no immaterial one
    assert (told.unit, told.full_scale_load_n, told.full_scale_reading) == ("mbar", 800.0, 140.0)
    assert (told.verdict, told.says, told.minor) == ("explained", "sentence", ())
    assert told.data_faults == (FAULT, "noise")
    assert (told.baseline.rmse, told.extended.rmse) == (pytest.approx(28.0), pytest.approx(14.0))
    assert (told.baseline.force_rmse_n, told.extended.force_rmse_n) == (9.0, 7.0)
    assert (told.baseline.structure_rms, told.extended.structure_rms) == (pytest.approx(42.0), pytest.approx(2.8))
    assert told.gain.gain_percent == pytest.approx(50.0)
    # Of the error's variance 0.04 as much is noise as what was fitted holds beside its structure.
    assert told.explainable_percent == pytest.approx(100.0 * (1.0 - (0.05**2 - 0.01**2) / 0.04))
    assert told.explained_percent == pytest.approx(75.0)
    assert (told.rivals, told.next_experiment) == (("rival of delay",), "next")
    assert told.likeness is parts.found.likeness
    (tare,) = told.limits_of_the_force
    assert "160 N less than what presses" in tare
    assert (told.limits, told.leftover, told.screening) == (("limit", tare, "it turned"), None, parts.found.screening)
    assert (told.model, told.rejected, told.parameters) == ("with offset", None, {"p": 1})
    assert told.baseline_model.to_dict() == replace(MODEL, noise=parts.off).to_dict()
    assert (told.covariance, told.traces, told.thresholds) == (((1.0,),), ("trace",), STANDARD)
    seen = parts.seen
    assert [residuals for _, residuals in seen["structure"]] == [
        ["held 0", "fitted 0"], ["held 2", "fitted 2"], ["fitted 2"],
    ]  # fmt: skip
    assert [[(one.name, list(one.usable)) for one in structure] for structure, _ in seen["structure"]] == [
        [("held", [True] * 3), ("fitted", [True] * 3)], [("held", [True] * 3), ("fitted", [True] * 3)],
        [("fitted", [True, True, False])],  # a cycle that is held out decides over no name
    ]  # fmt: skip
    assert seen["names_of"][0][1:] == (0.07, STANDARD)  # all beyond noise, of what was fitted
    assert seen["names_of"][1] == {
        "is_clocked": False, "doubt": "", "best_single": None, "together": [],
    }  # fmt: skip
    assert seen["zeros_of"][0][3:5] == (0.07, 1.0)  # what effects of the core remember
    assert seen["zeros_of"][0][6] == ("wanders", STANDARD.hold_s)
    assert seen["noise_with_memory"][0][3:] == (True, STANDARD.material, "memory")
    assert seen["next_experiment"][1] == {"open_": False, "worse": False}  # as little is left as is explained
    assert seen["infer_with_gas_check"][0][4] is True


def test_the_sentence_is_told_what_is_in_the_model_and_what_is_left(parts: Any) -> None:
    parts.names = [name_of("linear_leak")]
    told = run_diagnosis(parts)
    (causes, unnamed), _ = parts.seen["names_in"]
    assert ([one.name for one in causes], unnamed, told.minor) == (["linear_leak"], 1, ("delay",))
    assert parts.seen["unexplained_remark"][0] == (parts.kinds[1], 0.0, 0.0, STANDARD)
    assert "not_shown_to_be_noise" not in parts.seen
    given, named = parts.seen["sentence_of"]
    assert given == ("explained", "names", BEFORE, AFTER, "left", STANDARD)
    assert named == {"worse": False, "withheld": False}
