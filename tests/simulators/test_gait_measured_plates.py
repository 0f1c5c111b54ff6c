"""Plates' files in the place of simulated feet."""

from __future__ import annotations

import numpy as np
import pytest

from simulators.people import measured as feet_of
from simulators.people import trial
from smartshoe.errors import InputError
from smartshoe.recording import REGIONS


@pytest.mark.real_data
@pytest.mark.parametrize(
    ("name", "weight_n", "strikes"),
    [
        ("walk1.forces", (690, 790), 4),
        ("walk2.forces", (650, 750), 4),
        ("Gait.c3d", (600, 660), 2),
        ("grf_run.mot", (650, 730), 2),
        ("jump1.txt", (680, 700), 4),
    ],
)
def test_measured_feet_keep_their_force_and_get_regions(measured, name, weight_n, strikes):
    if name.endswith(".c3d"):
        pytest.importorskip("ezc3d")
    feet = feet_of(measured / "grf_walking_running" / name)
    assert weight_n[0] < feet.person.body_weight_n < weight_n[1]
    made = trial(activity=feet, sensors=False)
    assert sum(e.event == "heel_strike" for e in made.events) == strikes
    borne = sum(load.sum() for load in made.unit_n.values())
    whole = sum(force.sum() for force in made.total_n.values())
    assert borne / whole == pytest.approx(0.8, abs=0.05)
    assert min(load.min() for load in made.unit_n.values()) >= 0.0
    on_plates = np.interp(made.time_s, feet.measured_s - feet.measured_s[0], feet.foot_n.sum(axis=1))
    both = made.total_n["left"] + made.total_n["right"]
    # Contacts shorter than 80 ms and below 10 N are left out.
    assert np.abs(both - on_plates).max() < 25.0


@pytest.mark.real_data
def test_walking_feet_take_turns_and_load_heel_first(measured):
    made = trial(activity=feet_of(measured / "grf_walking_running" / "walk1.forces"), sensors=True)
    feet = [e.foot for e in made.events if e.event == "heel_strike"]
    assert feet == ["right", "left", "right", "left"]
    # The first stance alone.
    peaks = {region: made.time_s[made.unit_n[f"right_{region}"][:200].argmax()] for region in REGIONS}
    assert peaks["heel"] < peaks["meta4"] <= peaks["toe"]
    assert made.recording["right_heel"].unit.symbol == "mbar"


@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        ("a.forces", "[Force Data]\nSampleRate=450\n", "cut off"),
        ("a.mot", "endheader\ntime\tfoo\n0 1\n", "cut off"),
        ("a.txt", "x\ty\n0\t1\n", "no plates' file"),
        ("b.txt", "Time[s]\tGRF[N]\n0\tx\n", "cut off"),
    ],
)
def test_what_is_no_plates_file_is_refused(tmp_path, name, text, says):
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=says):
        feet_of(tmp_path / name)


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        feet_of(tmp_path / "none.forces")
