"""Ring, pixel columns and steps: the parts of the page's data, against their plain definitions."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from serving import walk_table

import smartshoe
from smartshoe.live._pixel_columns import joined, reduced
from smartshoe.live._ring import Ring
from smartshoe.live._steps import StepFollower

SIZES = st.lists(st.integers(0, 30), max_size=30)


@given(st.integers(1, 40), SIZES, st.integers(-5, 400))
def test_a_ring_holds_the_last_rows_under_the_places_they_ever_had(capacity: int, sizes: list[int], place: int) -> None:
    ring, written = Ring(capacity, 2), 0
    for size in sizes:
        numbers = np.arange(written, written + size, dtype=float)
        ring.append(numbers / 10, np.column_stack([numbers, -numbers]))
        written += size
    assert ring.end == written
    assert ring.begin == max(0, written - capacity)
    time_s, rows = ring.since(place)
    expected = np.arange(min(max(place, ring.begin), written), written)
    np.testing.assert_array_equal(rows[:, 0], expected)
    np.testing.assert_array_equal(time_s, expected / 10)
    np.testing.assert_array_equal(ring.after(place / 10)[1][:, 0], expected[expected > place])


@given(SIZES, st.sampled_from([0.004, 0.01, 0.033]), st.integers(0, 1000))
def test_columns_hold_least_and_greatest_whatever_the_blocks(sizes: list[int], width_s: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = sum(sizes)
    time_s = np.sort(rng.uniform(0.0, 1.0, n))
    rows = rng.normal(size=(n, 3))
    rows[rng.uniform(size=(n, 3)) < 0.2] = np.nan
    built = reduced(time_s[:0], rows[:0], width_s)
    start = 0
    for size in sizes:
        part = slice(start, start + size)
        built = joined(built, reduced(time_s[part], rows[part], width_s), 10_000)
        start += size
    places = np.floor(time_s / width_s).astype(int)
    np.testing.assert_array_equal(built.place, np.unique(places))
    for k, place in enumerate(built.place):
        inside = rows[places == place]
        for column in range(3):
            there = inside[~np.isnan(inside[:, column]), column]
            expected = (there.min(), there.max()) if there.size else (np.nan, np.nan)
            np.testing.assert_array_equal((built.low[k, column], built.high[k, column]), expected)
    assert len(joined(built, built.since(0), 5).since(0)) <= 5 or not len(built)


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> smartshoe.Recording:
    return smartshoe.read(walk_table(tmp_path_factory.mktemp("walk") / "walk.csv", 20.0, ("left",)))


def steps_of(walk: smartshoe.Recording, gain: float = 1.0, offset: float = 0.0) -> list[tuple[float, str]]:
    names = ("toe", "meta1", "meta4", "heel")
    loads = gain * np.column_stack([walk[f"left_{name}"].values for name in names]) + offset
    follower, found = StepFollower(names, 8.0 * gain), []
    for start in range(0, len(walk), 7):
        part = slice(start, start + 7)
        found += [(step.time_s, step.event) for step in follower.push(walk.time_s[part], loads[part])]
    return found


def test_each_stride_has_its_four_events_in_order_as_they_happen(walk: smartshoe.Recording) -> None:
    found = [step for step in steps_of(walk) if step[0] > 2.0]
    events = [event for _, event in found]
    first = events.index("heel_strike")
    cycle = ["heel_strike", "foot_flat", "heel_off", "toe_off"]
    assert events[first:] == (cycle * 20)[: len(events) - first]
    assert len(events) >= 4 * 17
    # The heel's hump begins at 0.02 s of each second, the toe's ends at 0.68 s.
    strikes = np.array([at for at, event in found if event == "heel_strike"]) % 1.0
    leaves = np.array([at for at, event in found if event == "toe_off"]) % 1.0
    assert np.abs(strikes - 0.02).max() < 0.05
    assert np.abs(leaves - 0.68).max() < 0.05


def test_offset_and_gain_move_no_step(walk: smartshoe.Recording) -> None:
    assert steps_of(walk, 3.0, -40.0) == steps_of(walk)


def test_standing_stays_on_the_ground_and_noise_is_no_step() -> None:
    time_s = np.arange(6000) / 200.0
    rng = np.random.default_rng(1)
    loads = rng.normal(0.0, 0.5, (time_s.size, 4))
    follower = StepFollower(("toe", "meta1", "meta4", "heel"), 8.0)
    assert follower.push(time_s[:1000], loads[:1000]) == []
    assert follower.phase is None
    found = follower.push(time_s[1000:], loads[1000:] + 50.0)
    assert [step.event for step in found] == ["heel_strike", "foot_flat"]
    assert follower.phase == 2


def chunk(tag: int, content: bytes) -> bytes:
    return struct.pack("<BIH", 4, len(content) + 2, tag) + content


def xdf_file(path: Path, time_s: np.ndarray, values: np.ndarray) -> None:
    """A file as LabRecorder writes it: two numeric channels with labels and units, and a stream of markers."""
    channels = "".join(
        f"<channel><label>{label}</label><unit>mbar</unit></channel>" for label in ("left_toe", "left_heel")
    )
    header = (
        '<?xml version="1.0"?><info><name>smartshoe left</name><type>Pressure</type><channel_count>2</channel_count>'
        "<nominal_srate>100</nominal_srate><channel_format>double64</channel_format><source_id>s</source_id>"
        f"<desc><channels>{channels}</channels></desc></info>"
    )
    markers = (
        '<?xml version="1.0"?><info><name>marks</name><type>Markers</type><channel_count>1</channel_count>'
        "<nominal_srate>0</nominal_srate><channel_format>string</channel_format></info>"
    )
    samples = b"".join(
        struct.pack("<Bd2d", 8, at, *row) for at, row in zip(time_s.tolist(), values.tolist(), strict=True)
    )
    mark = struct.pack("<BdBB", 8, float(time_s[3]), 1, 4) + b"trip"
    path.write_bytes(
        b"XDF:"
        + chunk(1, b'<?xml version="1.0"?><info><version>1.0</version></info>')
        + chunk(2, struct.pack("<I", 1) + header.encode())
        + chunk(2, struct.pack("<I", 2) + markers.encode())
        + chunk(3, struct.pack("<IBI", 1, 4, time_s.size) + samples)
        + chunk(3, struct.pack("<IBI", 2, 4, 1) + mark)
    )


def test_an_xdf_recording_is_read_with_its_names_units_and_stamps(tmp_path: Path) -> None:
    pytest.importorskip("pyxdf")
    time_s = 1234.5 + np.arange(300) / 100.0
    values = np.random.default_rng(3).uniform(0.0, 80.0, (300, 2))
    xdf_file(tmp_path / "walk.xdf", time_s, values)
    found = smartshoe.read(tmp_path / "walk.xdf")
    np.testing.assert_allclose(found.time_s, time_s - time_s[0], atol=1e-6)
    np.testing.assert_array_equal(found["left_toe"].values, values[:, 0])
    np.testing.assert_array_equal(found["left_heel"].values, values[:, 1])
    assert found["left_heel"].unit.symbol == "mbar"
    assert any("marks" in note for note in found.notes)
    data = (tmp_path / "walk.xdf").read_bytes()
    (tmp_path / "torn.xdf").write_bytes(data[:200])
    with pytest.raises(smartshoe.errors.InputError, match=r"torn\.xdf"):
        smartshoe.read(tmp_path / "torn.xdf")
