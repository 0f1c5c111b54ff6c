"""How answers are judged: on answers written by hand."""

from __future__ import annotations

import json
from typing import Any

import pytest
from bank_run import jobs_of, rows_of
from bank_tables import area_under_curve, calibration_error, figures, judged
from judging import judge


def effect(name: str, family: str, percent: float = 1.0, like: tuple[str, ...] = ()) -> dict[str, Any]:
    return {"id": name, "family": family, "law": "x", "strength_percent": percent, "cannot_be_told_from": list(like)}


def cause(name: str, family: str, confidence: float = 0.9, equivalents: tuple[str, ...] = ()) -> dict[str, Any]:
    return {"effect": name, "family": family, "confidence": confidence, "equivalents": list(equivalents)}


def row(
    kind: str, effects: list, causes: list, verdict: str, *, faults: tuple = (), after: float = 0.5
) -> dict[str, Any]:
    truth = {
        "kind": kind, "index": 0, "effects": effects, "zero": "seen", "sample_rate_hz": 100.0, "fit": ["a.csv"],
        "nuisances": [{"effect": "gain_drift", "family": "gain_drift", "strength_percent": 0.05}],
        "conditions": [{"effect": "load_cell_tare", "family": "tare", "strength_percent": 1.0}],
    }  # fmt: skip
    found = {
        "verdict": verdict, "causes": causes, "data_faults": [{"kind": kind_} for kind_ in faults],
        "baseline": {"rmse": {"value": 1.0}}, "extended": {"rmse": {"value": after}},
    }  # fmt: skip
    return {"world": "own", "kind": kind, "index": 0, "truth": truth, "found": found, "cpu_s": 1.0, "noise_rmse": 0.4}


LEAK, LOOP = effect("linear_leak", "leak"), effect("play_hysteresis", "hysteresis")


def test_a_nuisance_or_condition_may_come_before_the_hidden_effect_and_nothing_else():
    tare, leak = cause("load_cell_tare", "tare"), cause("linear_leak", "leak")
    assert judge(row("single", [LEAK], [tare, leak], "explained")).exact
    late = judge(row("single", [LEAK], [cause("dead_band", "dead_band"), leak], "explained"))
    assert not late.exact
    assert late.family
    assert late.false == ["dead_band"]


def test_an_equivalent_counts_only_where_the_truth_cannot_be_told_from_it():
    said = [cause("orifice_leak", "leak", equivalents=("linear_leak",))]
    assert not judge(row("single", [LEAK], said, "explained")).exact
    assert judge(row("single", [effect("linear_leak", "leak", like=("orifice_leak",))], said, "explained")).exact
    companion = judge(row("single", [LEAK], said, "explained"))
    assert companion.companions == ["orifice_leak"]
    assert not companion.names[0][1]
    assert companion.said_names[0][1]  # the confidence is said to be of the name or its equivalents
    assert not judge(row("single", [LOOP], said, "explained")).said_names[0][1]


def test_two_effects_are_exact_with_both_names_and_no_false_one():
    both = [cause("linear_leak", "leak"), cause("play_hysteresis", "hysteresis")]
    assert judge(row("two", [LEAK, LOOP], both, "explained")).exact
    with_false = judge(row("two", [LEAK, LOOP], [*both, cause("dead_band", "dead_band")], "explained"))
    assert with_false.all_named
    assert not with_false.exact
    one = judge(row("two", [LEAK, LOOP], both[:1], "partly_explained"))
    assert not one.family
    assert one.verdict


def test_a_fault_of_the_data_may_stand_among_the_faults():
    lost = effect("dropouts", "data")
    assert judge(row("single", [lost], [], "adequate", faults=("gaps",))).exact
    assert judge(row("single", [LEAK], [], "adequate", faults=("gaps",))).false_faults == ["gaps"]


def test_what_is_outside_must_be_flagged_and_not_named_surely():
    unknown = [effect("slow_sine", "outside")]
    assert judge(row("outside", unknown, [cause("zero_drift", "zero", 0.4)], "partly_explained")).exact
    assert not judge(row("outside", unknown, [cause("zero_drift", "zero", 0.8)], "partly_explained")).exact
    assert not judge(row("outside", unknown, [], "adequate")).exact


def test_a_tare_that_is_there_must_be_explained():
    assert not judge(row("none", [], [], "adequate")).verdict
    assert judge(row("none", [], [cause("load_cell_tare", "tare")], "explained")).verdict


def test_the_held_out_share_is_of_what_noise_leaves_to_explain():
    one = judge(row("single", [LEAK], [cause("linear_leak", "leak")], "explained"))
    assert one.explained == pytest.approx(1 - (0.25 - 0.16) / (1 - 0.16))
    assert not one.worse
    assert judge(row("single", [LEAK], [], "unexplained", after=1.2)).worse
    tried = row("single", [LEAK], [], "unexplained")
    assert not judge(tried).rejected
    tried["found"]["rejected"] = {"effects": {}}
    assert judge(tried).rejected
    assert judge(row("single", [effect("spikes", "noise")], [], "adequate")).explained is None


def test_a_zero_alone_leaves_a_model_nothing_to_explain():
    rows = [row("single", [LEAK], [], "explained"), row("single", [effect("zero_offset", "zero")], [], "explained")]
    rows[1]["found"]["extended"] = rows[1]["found"]["baseline"]
    by_name = {figure.name: figure for figure in figures("own", judged(rows))}
    mean, aside = (by_name[n] for n in by_name if "explained" in n or "alone" in n)
    assert (mean.count, aside.count) == (2, 1)
    assert mean.value == pytest.approx(aside.value / 2)


def test_a_diagnosis_that_raised_is_a_wrong_answer():
    raised = {**row("single", [LEAK], [], "explained"), "found": {"error": "ValueError: no"}}
    assert judge(raised).raised
    by_key = {figure.key: figure for figure in figures("own", judged([raised]))}
    assert by_key["exact"].value == 0.0
    assert by_key["exact"].met is False


def test_confidence_figures_are_those_of_their_definitions():
    names = [(0.9, True), (0.9, True), (0.9, False), (0.3, False)]
    assert calibration_error(names) == pytest.approx((abs(2.7 - 2) + 0.3) / 4)
    assert area_under_curve(names) == pytest.approx((2 + 2 * 0.5) / 4)


def test_rows_that_were_cut_short_are_run_again(tmp_path):
    path = tmp_path / "rows.jsonl"
    path.write_text(json.dumps(row("single", [LEAK], [], "adequate")) + '\n{"world": "own", "ki', encoding="utf-8")
    assert len(rows_of(path)) == 1
    kept = [job.index for job in jobs_of(["worlds:0-7"], "own", "", (0, 1))]
    assert kept == [0, 1, 3, 4, 6]
    assert {job.kind for job in jobs_of(["none:0-2"], "second_lab", "x", None)} == {"clean"}
    with pytest.raises(SystemExit, match="single:0-40"):
        jobs_of(["single"], "own", "", None)
