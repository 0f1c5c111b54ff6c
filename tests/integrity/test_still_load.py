"""A load that stands still while the reading goes on: its load cell is at its end, or its channel froze."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_integrity_faults import FALSELY_MASKED, NOISES_PERCENT, SEEDS, Array, kinds, recorded

from smartshoe import diagnose
from smartshoe.integrity import examine
from smartshoe.protocol import Protocol, dynamic_protocol, static_protocol
from smartshoe.recording import Channel, Recording


def with_load(recording: Recording, load: Array) -> Recording:
    """The recording with ``load`` (n,) as what the load cell logged."""
    return recording.with_channel(Channel.from_values(recording.load.name, load, recording.load.unit, "load"))


@settings(max_examples=12)
@given(SEEDS, NOISES_PERCENT, st.floats(0.4, 0.9), st.sampled_from([0.0, 0.3]))
def test_a_load_cell_that_ends_below_the_peaks_is_told_whether_it_is_noisy_there_or_not(
    seed, noise_percent, share, converter_n
):
    whole = recorded(dynamic_protocol(), seed, noise_percent)
    end_n = share * whole.force_n.max()
    noise = converter_n * np.random.default_rng(seed).standard_normal(len(whole))
    found = examine([with_load(whole, np.minimum(whole.force_n, end_n) + noise)])
    (fault,) = found.faults
    assert fault.kind == "saturation"
    assert fault.says.startswith("the load stands at its largest value")
    masked, cut = ~found.usable[0], whole.force_n >= end_n
    assert masked[cut].mean() > 0.95
    assert masked[whole.force_n < end_n - 0.02 * whole.force_n.max()].mean() < FALSELY_MASKED


def test_holds_beyond_a_load_cells_end_are_left_out_too_also_of_other_recordings():
    """Of a hold just beyond its end nothing in the recording tells that it is no honest one."""
    moves, holds = recorded(dynamic_protocol(), 4), recorded(static_protocol((300.0, 505.0)), 4)
    cut = [with_load(one, np.minimum(one.force_n, 500.0)) for one in (moves, holds)]
    assert not examine(cut[1:]).faults
    found = examine(cut)
    assert [(fault.kind, fault.recording) for fault in found.faults] == [("saturation", 0), ("saturation", 1)]
    assert "as in another recording" in found.faults[1].says
    assert (~found.usable[1])[holds.force_n >= 500.0].mean() > 0.95


@settings(max_examples=12)
@given(SEEDS, NOISES_PERCENT, st.floats(0.1, 0.5), st.floats(22.0, 40.0), st.sampled_from([0.0, 0.2]))
def test_a_load_channel_that_freezes_under_cycles_is_told(seed, noise_percent, begins, lasts_s, noise_n):
    """It repeats one value, or an amplifier lets go of its bridge, and its noise is logged about that value."""
    whole = recorded(dynamic_protocol((100.0, 200.0), repeats=3), seed, noise_percent)
    start = int(begins * len(whole))
    start += int(np.argmax(whole.force_n[start:] > 0.3 * whole.force_n.max()))  # not while it rests at its least
    frozen = (np.arange(len(whole)) >= start) & (whole.time_s < whole.time_s[start] + lasts_s)
    level_n = whole.force_n[start] + noise_n * np.random.default_rng(seed).standard_normal(len(whole))
    found = examine([with_load(whole, np.where(frozen, level_n, whole.force_n))])
    assert kinds(found) == {"held_samples"}
    assert "its channel froze" in found.faults[0].says
    assert (~found.usable[0])[frozen].mean() > 0.95
    assert (~found.usable[0])[~frozen].mean() < FALSELY_MASKED


@pytest.mark.parametrize("lag_s", [0.0, 0.1])
@pytest.mark.parametrize("protocol", [static_protocol((100.0, 500.0, 800.0)), dynamic_protocol()])
def test_a_commanded_load_that_is_held_stands_as_it_should(protocol: Protocol, lag_s: float) -> None:
    """The reading overshoots its hold, late and relaxing, and is late again as the load leaves."""
    time_s = np.arange(0.0, protocol.duration_s, 0.01)
    load = protocol.load_at(time_s)
    late = np.interp(time_s - lag_s, time_s, load)
    wall = np.zeros(load.size)
    for k in range(1, load.size):
        wall[k] = wall[k - 1] + 0.01 / 0.8 * (late[k] - wall[k - 1])
    reading = 0.1 * (late + 0.2 * (late - wall)) + 0.03 * np.random.default_rng(0).standard_normal(load.size)
    one = Recording.from_arrays(time_s=time_s, force_n=load, pressure_mbar=reading)
    assert not [fault for fault in examine([one]).faults if "the load" in fault.says]


@pytest.mark.parametrize("frozen_s", [(13.0, 20.0), (5.0, 12.0)])
def test_a_channel_that_froze_in_a_rest_or_a_hold_jumps_to_where_the_load_has_gone(frozen_s) -> None:
    """From a rest into the way to the next hold, from a hold into the rest after it."""
    whole = recorded(static_protocol((800.0, 800.0), rate_n_per_s=400.0, approach_s=1.0), 6)
    frozen = (whole.time_s >= frozen_s[0]) & (whole.time_s < frozen_s[1])
    first = whole.force_n[int(np.argmax(frozen))]
    found = examine([with_load(whole, np.where(frozen, first, whole.force_n))])
    assert [fault.kind for fault in found.faults] == ["held_samples"]
    assert (~found.usable[0])[frozen].all()


def test_a_unit_that_is_disturbed_while_nothing_is_on_it_has_a_sound_load() -> None:
    """A logged load of nothing may be true whatever the unit reads: a draught, or a foot in the shoe."""
    whole = recorded(dynamic_protocol(), 3)
    load = np.maximum(whole.force_n - 0.2 * whole.force_n.max(), 0.0)
    assert not [fault for fault in examine([with_load(whole, load)]).faults if "the load" in fault.says]


def test_a_unit_under_a_load_cell_that_clips_is_found_as_good_as_it_is() -> None:
    """Half of the load is cut off: the unit was told a nonlinearity of 7 % of full scale."""
    whole = recorded(dynamic_protocol(), 5)
    clipped = with_load(whole, np.minimum(whole.force_n, 400.0))
    found = diagnose([replace(clipped, name="clipped")])
    assert found.verdict == "adequate"
    assert not found.causes
