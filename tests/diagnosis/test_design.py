"""What a protocol can tell before anything is measured, against what is known of each pair."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from smartshoe import dynamic_protocol, static_protocol
from smartshoe.cli import run_command
from smartshoe.diagnosis import Thresholds
from smartshoe.diagnosis._experiments import EXPERIMENTS
from smartshoe.diagnosis.design import Design, design, too_short_of
from smartshoe.errors import UsageError
from smartshoe.protocol import Protocol, Segment

CURVES = {"contact_area", "gas_compression", "sensor_nonlinearity", "wall_hardening"}


@pytest.fixture(scope="module")
def triangles() -> Design:
    return design([dynamic_protocol((100, 200, 400, 800))])


def test_no_waveform_tells_curves_apart_that_bend_the_same_way(triangles: Design) -> None:
    """The sensor's bends either way; gas makes a unit stiffer with load, contact and wall softer and stiffer alike."""
    assert set(triangles.cannot_be_told("sensor_nonlinearity")) >= CURVES - {"sensor_nonlinearity"}
    for name in CURVES - {"sensor_nonlinearity"}:
        assert "sensor_nonlinearity" in triangles.cannot_be_told(name)
    assert "wall_hardening" in triangles.cannot_be_told("contact_area")
    assert "contact_area" in triangles.cannot_be_told("wall_hardening")


def test_what_bends_the_other_way_is_told(triangles: Design) -> None:
    """Physics allows a gas that is compressed no other sign, nor a wall that hardens."""
    assert not {"contact_area", "wall_hardening"} & {*triangles.cannot_be_told("gas_compression")}
    place = triangles.names.index("gas_compression"), triangles.names.index("wall_hardening")
    assert triangles.unlike[place] > 0.9


def test_triangles_alone_leave_a_leak_a_set_and_a_drift_open_and_holds_tell_a_creep(triangles: Design) -> None:
    """A drift goes either way, a leak takes the reading down, a set leaves it up."""
    assert {"orifice_leak", "zero_drift"} <= set(triangles.cannot_be_told("linear_leak"))
    assert "zero_drift" in triangles.cannot_be_told("permanent_set")
    assert "permanent_set" not in triangles.cannot_be_told("linear_leak")
    both = design([dynamic_protocol((100, 200, 400, 800)), static_protocol()])
    assert len(both.cannot_be_told("clock_drift")) < len(triangles.cannot_be_told("clock_drift"))


def test_minor_loops_tell_friction_from_a_gain_by_direction(triangles: Design) -> None:
    loops = design([EXPERIMENTS["minor_loops"](800.0)])
    name, other = "load_unload_asymmetry", "play_hysteresis"
    place = triangles.names.index(name), triangles.names.index(other)
    assert loops.unlike[place] > 1.3 * triangles.unlike[place]


def test_less_noise_and_larger_effects_leave_no_more_open() -> None:
    protocol = [dynamic_protocol((200, 800))]
    noisy, quiet = (design(protocol, noise_percent=noise) for noise in (1.0, 0.02))
    for name in noisy.names:
        assert set(quiet.cannot_be_told(name)) <= set(noisy.cannot_be_told(name))
    assert np.all(quiet.least <= noisy.least)


def test_noise_size_and_length_count_as_in_a_test_of_a_mean(triangles: Design) -> None:
    """-2 log evidence is that of n samples of an effect of so many noises; four times as much is half the size."""
    protocol = dynamic_protocol((100, 200, 400, 800))
    louder = design([protocol], noise_percent=0.2)
    stronger = design([protocol], strength_percent=0.6)
    twice = design([protocol, protocol])
    assert stronger.evidence == pytest.approx(4.0 * triangles.evidence)
    assert louder.evidence == pytest.approx(triangles.evidence / 4.0)
    assert twice.evidence == pytest.approx(2.0 * triangles.evidence, rel=0.01)
    # White noise of a sample, at the log's rate, whatever is thinned.
    assert triangles.evidence == pytest.approx(protocol.duration_s * 100.0 * 3.0**2, rel=0.02)
    seen = np.isfinite(triangles.least)
    # What shows is so many noises, or what counts at all.
    ratio = design([protocol], noise_percent=20.0).least[seen] / design([protocol], noise_percent=10.0).least[seen]
    assert np.all((ratio > 1.0) & (ratio < 2.0 + 1e-9))
    assert np.max(ratio) == pytest.approx(2.0)
    material = replace(Thresholds(), material=0.01)
    least = design([protocol], thresholds=material).least
    assert np.all(least[seen] >= 0.01)


def test_an_effect_that_the_baseline_follows_whole_is_never_seen() -> None:
    """Without a load that moves nothing that acts on it shows."""
    held = Protocol("held", (Segment("ramp", 400.0, 1.0), Segment("hold", 400.0, 60.0)))
    told = design([held])
    assert np.isinf(told.least).any()
    listed = {one["effect"]: one["least_percent_of_full_scale"] for one in told.to_dict()["effects"]}
    for name, least in zip(told.names, told.least, strict=True):
        assert listed[name] == (pytest.approx(100.0 * float(least)) if np.isfinite(least) else None)


def test_what_is_unlike_is_a_share_and_nothing_is_unlike_itself(triangles: Design) -> None:
    assert np.all((triangles.unlike >= 0.0) & (triangles.unlike <= 1.0))
    assert np.all(np.diag(triangles.unlike) == 0.0)
    for name in triangles.names:
        assert name not in triangles.cannot_be_told(name)
    k = triangles.names.index("gas_compression")
    alike = [triangles.names.index(name) for name in triangles.cannot_be_told("gas_compression")]
    order = [float(triangles.unlike[k, j]) for j in alike]
    assert order == sorted(order)
    told = triangles.to_dict()
    assert told["strength_percent_of_full_scale"] == pytest.approx(0.3)
    assert len(told["pairs"]) == len(triangles.names) * (len(triangles.names) - 1)
    pair = next(one for one in told["pairs"] if one["effects"] == ["gas_compression", "delay"])
    assert pair["unlike"] == float(triangles.unlike[k, triangles.names.index("delay")])


def test_a_design_asks_for_a_protocol_and_for_positive_numbers() -> None:
    with pytest.raises(UsageError, match="needs a protocol"):
        design([])
    with pytest.raises(UsageError, match="noise_percent"):
        design([dynamic_protocol((200,))], noise_percent=0.0)


def test_the_command_asks_a_scenario_and_no_file(root: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scenario = str(root / "scenarios" / "calibration.toml")
    assert run_command(["diagnose", "--design", scenario, "--json", "-"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["schema"] == "smartshoe.design/1"
    assert {one["effect"] for one in told["effects"]} >= CURVES
    assert run_command(["diagnose", "x.csv", "--design", scenario]) == 2
    assert run_command(["diagnose"]) == 2


def _asked(tmp_path: Path, text: str) -> list[str]:
    (tmp_path / "asked.toml").write_text(text)
    return ["diagnose", "--design", str(tmp_path / "asked.toml"), "--json", str(tmp_path / "told.json")]


def test_the_command_takes_the_largest_noise_of_the_scenarios_units(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    units = "".join(
        f'[[unit]]\nname = "unit_{k}"\nsensor = {{noise_percent = {noise}}}\n' for k, noise in enumerate((0.5, 2.0, 0))
    )
    assert run_command(_asked(tmp_path, "[protocol.dynamic]\nrates_n_per_s = [200.0]\n" + units)) == 0
    assert "noise of 2 % of full scale" in capsys.readouterr().err
    told = json.loads((tmp_path / "told.json").read_text())
    assert told == design([dynamic_protocol((200.0,))], noise_percent=2.0).to_dict()
    wrong = units.replace("2.0", "-2.0")
    assert run_command(_asked(tmp_path, "[protocol.dynamic]\n" + wrong)) != 0
    assert "unit.1.sensor.noise_percent" in capsys.readouterr().err
    silent = "[protocol.dynamic]\nrates_n_per_s = [200.0]\n" + units.replace("0.5", "0").replace("2.0", "0")
    assert run_command(_asked(tmp_path, silent)) == 0
    assert "since no unit of the scenario states any above 0" in capsys.readouterr().err  # each states one


def test_the_command_takes_the_lowest_rate_that_a_unit_is_logged_at(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    protocol, machine = "[protocol.dynamic]\nrates_n_per_s = [200.0]\n", "[machine]\ndaq = {sample_rate_hz = 50}\n"
    units = '[[unit]]\nname = "a"\n[[unit]]\nname = "b"\ndaq = {sample_rate_hz = 20}\n'
    assert run_command(_asked(tmp_path, protocol + machine + units)) == 0
    assert "logged at 20 Hz" in capsys.readouterr().err
    told = json.loads((tmp_path / "told.json").read_text())
    assert told == design([dynamic_protocol((200.0,))], sample_rate_hz=20.0).to_dict()
    assert run_command(_asked(tmp_path, protocol + '[[unit]]\nname = "a"\n')) == 0
    assert "logged at 100 Hz" in capsys.readouterr().err
    for wrong in ("-5", '"often"', "true"):
        assert run_command(_asked(tmp_path, protocol + units.replace("20", wrong))) != 0
        assert "unit.1.daq.sample_rate_hz" in capsys.readouterr().err


def test_a_design_says_what_a_diagnosis_of_such_recordings_would_lack(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    once = Protocol("once", (Segment("rest", 0.0, 5.0), Segment("ramp", 800.0, 5.0), Segment("ramp", 0.0, 5.0)))
    assert design([once]).limits[0].startswith("one load cycle of one recording")
    for protocols in ([once, once], [dynamic_protocol((200,), repeats=3)]):
        assert not any(said.startswith("one load cycle of one recording") for said in design(protocols).limits)
    assert not any("held out" in said for said in design([once]).limits)  # which is asked of no design
    assert any("one loading rate only" in said for said in design([once, once]).limits)
    assert design([EXPERIMENTS["rates"](800.0), EXPERIMENTS["holds_at_several_loads"](800.0)]).limits == ()
    assert (
        run_command(_asked(tmp_path, '[protocol.t]\nkind = "static"\nloads_n = [800]\n[[unit]]\nname = "toe"\n')[:3])
        == 0
    )
    assert "limits of these protocols" in capsys.readouterr().out


ONE_RATE = [dynamic_protocol((200,), repeats=6)]


def _held(seconds: float) -> list[Protocol]:
    """Six times to 800 N at 200 N/s, where the load stays for so long."""
    corners = (("ramp", 800.0, 4.0), ("hold", 800.0, seconds), ("ramp", 0.0, 4.0), ("rest", 0.0, 5.0))
    return [Protocol("held", (Segment("rest", 0.0, 5.0), *(Segment(*one) for one in corners * 6)))]  # type: ignore[arg-type]


def test_at_one_rate_a_gain_that_goes_with_it_never_shows_unless_a_load_is_held() -> None:
    """It is another gain there, but for corners, which thinned samples round: of 5 % nothing is found.

    The table said 0.19 % above "nothing can be said of rate dependence"; beside holds it is found, and that was said.
    """
    told = design(ONE_RATE)
    assert np.isinf(told.least[told.names.index("rate_gain")])
    assert not any("rate_gain" in told.cannot_be_told(name) for name in told.names if name != "rate_gain")
    assert any("nothing can be said of rate dependence" in said for said in told.limits)
    held = design(_held(2.0))
    assert held.least[held.names.index("rate_gain")] < 0.001
    assert any("how a ramp differs from a hold" in said for said in held.limits)
    assert np.isfinite(told.least[told.names.index("play_hysteresis")])  # which rates show too, and other things


def test_a_design_tells_which_effects_it_leaves_out_and_what_they_need(
    root: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    told = design(ONE_RATE)
    assert told.left_out == {"cross_talk": {"neighbour"}}
    assert "cross_talk" not in told.names
    assert told.to_dict()["left_out"] == [{"effect": "cross_talk", "needs": ["neighbour"]}]
    assert run_command(["diagnose", "--design", str(root / "scenarios" / "calibration.toml")]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "logged: cross talk needs the neighbouring unit's reading, logged" in said


def test_a_protocol_of_which_a_log_takes_too_few_samples_is_refused_with_a_remedy(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It ended in "p holds one sample", as if a file could not be read."""
    text = '[protocol.p]\nkind = "segments"\ncorners = [[0, 0], [0.5, 10], [{0}, 0]]\n[[unit]]\nname = "toe"\n'
    for last_s, samples in ((0.98, "98 samples"), (0.502, "51 samples")):
        assert run_command(_asked(tmp_path, text.format(last_s))) == 2
        said = capsys.readouterr().err
        assert "asked.toml, line 1, key protocol.p: protocol p lasts" in said
        assert f"of which a log of 100 Hz takes {samples}, and a diagnosis needs 100: make it longer" in said
    assert run_command(_asked(tmp_path, text.format(1.0))) == 0
    short = Protocol("short", (Segment("ramp", 10.0, 0.001), Segment("ramp", 0.0, 0.001)))
    with pytest.raises(UsageError, match=r"protocol short lasts 0\.002 s, of which a log of 100 Hz takes 1 sample"):
        design([*ONE_RATE, short])


def test_a_design_refuses_what_the_simulated_machine_does(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = '[protocol.p]\nkind = "segments"\ncorners = [[0, 0], [5, {0}], [9, 0], [12, 0]]\n[[unit]]\nname = "toe"\n'
    assert run_command(_asked(tmp_path, text.format(2001))) == 2
    designed = capsys.readouterr().err
    assert "asked.toml, line 1, key protocol.p: simulated Instron 5944 with toe" in designed
    assert "the machine's limit is 2000 N: lower the load" in designed
    assert not (tmp_path / "told.json").exists()
    assert run_command(["simulate", str(tmp_path / "asked.toml"), "--out", str(tmp_path / "made")]) == 2
    assert capsys.readouterr().err.splitlines()[-1] == designed.splitlines()[-1]
    assert run_command(_asked(tmp_path, text.format(800))) == 0


def test_a_proposed_protocol_alone_is_told_what_a_design_needs_beside_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_command(_asked(tmp_path, "[protocol.dynamic]\n")) == 2
    said = capsys.readouterr().err
    assert "asked.toml, key unit: there is none, and a design takes noise and rate from units: add [[unit]]" in said
    assert run_command(_asked(tmp_path, '[machine]\nbackend = "sim:instron"\n')) == 2
    said = capsys.readouterr().err
    assert "key protocol: there is none, and a design asks about protocols: add a [protocol.dynamic], and [[" in said


def test_the_command_names_the_file_and_key_where_there_is_no_protocol(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_command(_asked(tmp_path, '[[unit]]\nname = "toe"\nrecordings = ["toe.csv"]\n')) != 0
    said = capsys.readouterr().err
    assert "asked.toml" in said
    assert "key protocol" in said


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ('[protocol.a]\nkind = "static"\nloads_n = []', ("line 3", "key protocol.a.loads_n", "the list is empty")),
        ('[protocol.a]\nkind = "dynamic"\nrates_n_per_s = []', ("key protocol.a.rates_n_per_s", "the list is empty")),
        ('[protocol.a]\nkind = "segments"\ncorners = [[0, 0], [5, 0]]', ("no load is put on in a",)),
    ],
)
def test_a_protocol_that_presses_nothing_is_refused_in_a_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], table: str, words: tuple[str, ...]
) -> None:
    assert run_command(_asked(tmp_path, f'{table}\n[[unit]]\nname = "toe"\n')) == 2
    said = capsys.readouterr().err
    assert all(one in said for one in words)
    assert "itself is at fault" not in said
    assert not (tmp_path / "told.json").exists()


@pytest.mark.parametrize(
    "more", [("--out", "o"), ("--calibration", "c.json"), ("--material", "5"), ("--unit", "toe"), ("--sensor", "6")]
)
def test_the_command_refuses_options_that_a_design_does_not_heed(
    root: Path, more: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_command(["diagnose", "--design", str(root / "scenarios" / "calibration.toml"), *more]) == 2
    assert f"--design takes no {more[0]}" in capsys.readouterr().err


@pytest.mark.parametrize("given", [0.02, 0, {}])
def test_a_design_is_decided_by_thresholds_alone(given: object) -> None:
    press = dynamic_protocol((400,))
    said = f"thresholds is of type {type(given).__name__}: give Thresholds"
    with pytest.raises(UsageError, match=said):
        design([press], thresholds=given)  # type: ignore[arg-type]
    with pytest.raises(UsageError, match=said):
        too_short_of(press, 100.0, given)  # type: ignore[arg-type]
