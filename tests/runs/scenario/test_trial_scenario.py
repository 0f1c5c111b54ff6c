"""``[trial]``: a person in calibrated shoes, from the scenario's file to forces against the truth."""

from __future__ import annotations

import json

import numpy as np
import pytest

from smartshoe.cli import run_command
from smartshoe.errors import ScenarioError
from smartshoe.files.logs import read, write
from smartshoe.runs.scenario import load, run, simulate_trial
from smartshoe.runs.scenario._against_truth import onsets
from smartshoe.runs.scenario.publish import publish

REGIONS = ("toe", "meta1", "meta4", "heel")
SHORT = (
    '[protocol.dynamic]\nrates_n_per_s = [200, 800]\n\n'
    + "".join(f'[[unit]]\nname = "left_{region}"\n' for region in REGIONS)
)  # fmt: skip


def scenario_of(tmp_path, trial, text=SHORT):
    path = tmp_path / "scenario.toml"
    path.write_text(text + "\n" + trial)
    return path


def test_the_papers_standing_trial_is_within_one_percent_of_body_weight(root):
    result = run(*load(root / "scenarios" / "standing.toml"))
    against = result.trial.against_truth
    assert result.trial.gait.activity == "standing"
    assert against["body_weight_n"] == 519.4
    # Step-on at the beginning counts as standing from 2 % of body weight on: a second of sixty, half loaded.
    assert against["standing_total_n"]["truth"] == pytest.approx(519.4, rel=0.005)
    assert against["standing_total_n"]["corrected"] == pytest.approx(519.4, rel=0.01)
    assert against["rmse_total_percent_of_body_weight"]["corrected"] < 1.5


def test_the_papers_treadmill_trial_is_a_run_heavier_on_the_right(root):
    result = run(*load(root / "scenarios" / "treadmill.toml"))
    trial = result.trial
    against = trial.against_truth
    assert trial.gait.activity == "running"
    assert trial.gait.summary["order_of_contact"] == ["heel", "meta4", "meta1", "toe"]
    assert against["order"]["truth"]["meta4_before_meta1_percent"] > 90
    assert against["order"]["observed"]["meta4_before_meta1_percent"] == pytest.approx(
        against["order"]["truth"]["meta4_before_meta1_percent"], abs=2.0
    )
    for name in ("truth", "raw", "corrected"):
        assert against["peaks_n"]["right"][name] > against["peaks_n"]["left"][name]
    assert against["rmse_coils_n"]["corrected"] < 0.6 * against["rmse_coils_n"]["raw"]
    assert against["strides_total_n"]["corrected"] == pytest.approx(519.4, rel=0.01)
    for event in ("heel_strike", "toe_off"):
        errors = against["events"][event]
        assert errors["missed"] == errors["false"] == 0
        assert errors["median_ms"] < 10
        assert errors["p95_ms"] < 20


def test_a_trial_of_one_shoe_runs_and_is_published(tmp_path):
    walk = (
        '[trial]\nname = "walk"\nshoe = "sim:walk"\nduration_s = 12.0\ncoverage = 0.8\n[trial.gait]\ncoverage = 0.8\n'
    )
    result = run(*load(scenario_of(tmp_path, walk)))
    trial = result.trial
    assert trial.gait.activity == "walking"
    assert set(trial.totals_n()) >= {"raw", "truth"}
    assert trial.against_truth["rmse_coils_n"]["corrected"] < 5.0
    page = publish(result, tmp_path / "out", json.dumps(result.to_dict()))
    text = page.read_text()
    assert "Trial: walk" in text
    assert 'href="trial/gait.html"' in text
    assert {p.name for p in (tmp_path / "out" / "trial").iterdir()} >= {"walk.csv", "walk_truth.csv", "gait.html"}


def test_simulate_writes_the_trial_and_its_truth_and_gait_reads_it(tmp_path, capsys):
    walk = '[trial]\nname = "walk"\nduration_s = 15.0\nbody_weight_n = 700.0\n'
    scenario = scenario_of(tmp_path, walk)
    assert run_command(["simulate", str(scenario), "--out", str(tmp_path / "d")]) == 0
    recorded, true = read(tmp_path / "d" / "walk.csv"), read(tmp_path / "d" / "walk_truth.csv")
    assert [c.name for c in recorded.sensors] == [f"left_{region}" for region in REGIONS]
    borne = sum(true[f"left_{region}"].si for region in REGIONS)
    np.testing.assert_allclose(borne, true["left_total"].si, rtol=0, atol=1e-3)  # coverage is 1 where nothing is said
    assert true["left_total"].si.max() > 600.0
    assert run_command(["gait", str(tmp_path / "d" / "walk.csv"), "--json", str(tmp_path / "gait.json")]) == 0
    found = json.loads((tmp_path / "gait.json").read_text())
    assert found["activity"] == "walking"
    assert "walk.csv" in capsys.readouterr().out


def test_a_recorded_trial_is_replayed_from_beside_the_scenario(tmp_path):
    made = simulate_trial(*load(scenario_of(tmp_path, "[trial]\nduration_s = 12.0\n")))
    write(made.recording, tmp_path / "walk.csv")
    replayed = run(*load(scenario_of(tmp_path, '[trial]\nshoe = "replay:walk.csv"\n'))).trial
    assert replayed.recorded.truth is None
    assert replayed.against_truth is None
    assert replayed.recording["left_heel"].values == pytest.approx(made.recording["left_heel"].values)
    assert replayed.gait.activity == "walking"


def test_a_trials_seed_is_its_own(tmp_path):
    walk = "[trial]\nduration_s = 3.0\n"
    first = simulate_trial(*load(scenario_of(tmp_path, walk)))
    again = simulate_trial(*load(scenario_of(tmp_path, walk)))
    other = simulate_trial(*load(scenario_of(tmp_path, walk.replace("3.0", '3.0\nname = "second"'))))
    assert np.array_equal(first.recording["left_heel"].values, again.recording["left_heel"].values)
    assert not np.array_equal(first.recording["left_heel"].values, other.recording["left_heel"].values)


def test_a_unit_of_the_scenario_is_the_one_that_is_worn(tmp_path):
    stiff = SHORT.replace('name = "left_heel"\n', 'name = "left_heel"\nbladder = {effective_area_m2 = 0.1}\n')
    walk = "[trial]\nduration_s = 4.0\n"
    plain = simulate_trial(*load(scenario_of(tmp_path, walk))).recording["left_heel"].values.max()
    assert simulate_trial(*load(scenario_of(tmp_path, walk, stiff))).recording["left_heel"].values.max() < 0.5 * plain


def test_a_scenario_without_a_trial_has_none(tmp_path):
    result = run(*load(scenario_of(tmp_path, "")))
    assert result.trial is None
    assert "trial" not in result.to_dict()


@pytest.mark.parametrize(
    ("trial", "says"),
    [
        ("[trial]\nspeed = 3\n", r"line \d+, key trial.speed: this key is not known"),
        ('[trial]\nshoe = "sim:hop"\n', r"key trial.shoe: simulated shoe 'hop' is not known"),
        ("[trial]\nspeed_m_per_s = 5.0\n", "walk at 5 m/s"),
        ('[trial]\nname = "../out"\n', "key trial.name"),
        ("[trial]\n[trial.gait]\ncoverage = 1.5\n", "key trial.gait.coverage"),
        ("[trial]\n[trial.gait]\nweight = 1.5\n", "key trial.gait.weight: this key is not known"),
    ],
)
def test_a_wrong_trial_is_told_with_line_and_key(tmp_path, trial, says):
    path = scenario_of(tmp_path, trial)
    with pytest.raises(ScenarioError, match=says):
        simulate_trial(*load(path))


def test_a_trial_in_units_that_nobody_calibrates_is_refused(tmp_path):
    path = scenario_of(tmp_path, '[trial]\nside = "both"\nduration_s = 2.0\n')
    with pytest.raises(ScenarioError, match=r"key trial: right_toe, .* would not be calibrated: add a \[\[unit\]\]"):
        run(*load(path))


def test_onsets_are_where_the_load_rises_through_the_level():
    time_s = np.arange(0.0, 4.0, 0.1)
    load_n = np.maximum(0.0, 100.0 * np.sin(np.pi * time_s))  # stances from 0 to 1 s, and from 2 to 3 s
    found = onsets(time_s, load_n, 50.0, [(0.0, 1.0), (2.0, 3.0), (1.2, 1.8)])
    assert found[:2] == pytest.approx([1 / 6, 2 + 1 / 6], abs=0.003)
    assert np.isinf(found[2])
