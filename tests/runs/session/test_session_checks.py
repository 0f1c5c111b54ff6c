"""Each fault of a pressing is seen while the unit lies there, named, and asks for a bounded number of repeats."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from bench_sessions import SHORT, bench_plan

from smartshoe.devices import Shoe, open_shoe
from smartshoe.devices._base import Block
from smartshoe.errors import InputError, RefusedError
from smartshoe.files.logs import write
from smartshoe.protocol import dynamic_protocol
from smartshoe.recording import Channel, Recording
from smartshoe.runs.session import PressingFault, SessionFolder, Unattended, conduct
from smartshoe.runs.session import _machine_run as machine_run
from smartshoe.runs.session._checks import AT_THE_END, Pressing, _share, contact, first_fault, other_test, wrong_unit
from smartshoe.runs.session._procedure import _Pressing, _Stream
from smartshoe.runs.session.streaming import Seconds
from smartshoe.units import MILLIBAR


@pytest.fixture(scope="module")
def pressed(tmp_path_factory: pytest.TempPathFactory) -> Pressing:
    with SessionFolder.begin(tmp_path_factory.mktemp("pressed"), bench_plan()) as folder:
        conduct(folder)
        attempt = folder.attempts()[0]
        return Pressing("left_toe", SHORT, attempt.stream(), attempt.load())


def _changed(evidence: Pressing, change: Callable[[Channel], np.ndarray]) -> Pressing:
    channel = evidence.reading
    made = replace(channel, values=change(channel))
    return replace(evidence, stream=evidence.stream.with_channel(made))


def _kind(evidence: Pressing) -> str | None:
    found = first_fault(AT_THE_END, evidence)
    return None if found is None else found.kind


def test_a_good_pressing_has_no_fault(pressed: Pressing) -> None:
    assert _kind(pressed) is None


def test_a_reading_at_the_end_of_its_range_is_saturation(pressed: Pressing) -> None:
    assert pressed.reading.range_ is not None
    high = pressed.reading.range_[1]
    assert _kind(_changed(pressed, lambda c: np.minimum(c.values * 1.3, high))) == "saturation"
    assert _kind(_changed(pressed, lambda c: np.minimum(c.values * 1.1, high))) is None


def test_the_unit_that_is_really_pressed_is_named(pressed: Pressing) -> None:
    found = first_fault(AT_THE_END, replace(pressed, unit="left_heel"))
    assert found is not None
    assert found.kind == "wrong_unit"
    assert "left_toe is pressed, not left_heel" in found.says
    assert _kind(replace(pressed, unit="left_heel", load=None)) == "wrong_unit"


@pytest.mark.parametrize(
    ("own", "other", "is_wrong"),
    [(0.05, 1.0, True), (0.15, 1.0, False), (0.005, 0.12, False), (1.0, 0.05, False)],
)
def test_without_a_load_another_unit_is_pressed_that_moves_ten_times_as_much(
    pressed: Pressing, own: float, other: float, is_wrong: bool
) -> None:
    """And by a tenth of its range at least: a shoe that is only handled reads something everywhere."""
    stream = pressed.stream
    shape = pressed.reading.values - pressed.reading.values.min()
    shape = 150.0 * shape / shape.max()  # of 200 mbar
    for name, factor in (("left_toe", own), ("left_heel", other)):
        stream = stream.with_channel(replace(stream[name], values=factor * shape, range_=(0.0, 200.0)))
    for name in ("left_meta1", "left_meta4"):
        stream = stream.with_channel(replace(stream[name], values=0.0 * shape))
    found = wrong_unit(replace(pressed, stream=stream, load=None))
    assert (found is not None) is is_wrong
    assert found is None or "left_heel is pressed, not left_toe" in found.says


def test_a_unit_that_reads_nothing_has_no_contact(pressed: Pressing) -> None:
    rng = np.random.default_rng(1)
    assert _kind(_changed(pressed, lambda c: rng.normal(0.0, 0.05, c.values.size))) in ("no_contact", "wrong_unit")
    assert _kind(replace(_changed(pressed, lambda c: 0.001 * c.values), load=None)) == "no_contact"


@pytest.mark.parametrize(("share", "kind"), [(0.015, "no_contact"), (0.03, None)])
def test_contact_is_a_fiftieth_of_the_range(pressed: Pressing, share: float, kind: str | None) -> None:
    low, high = pressed.reading.range_ or (np.nan, np.nan)
    span = np.ptp(pressed.reading.values)
    lowered = _changed(pressed, lambda c: c.values * share * (high - low) / span)
    found = first_fault((contact,), lowered)
    assert (None if found is None else found.kind) == kind


@pytest.mark.parametrize(("factor", "kind"), [(0.96, None), (1.04, None), (0.94, "other_test"), (1.07, "other_test")])
def test_a_log_whose_peak_is_a_twentieth_off_is_another_tests(
    pressed: Pressing, factor: float, kind: str | None
) -> None:
    load = pressed.load
    assert load is not None
    asked = factor * pressed.protocol.peak_load_n / load.load.values.max()
    scaled = load.with_channel(replace(load.load, values=asked * load.load.values))
    found = first_fault((other_test,), replace(pressed, load=scaled))
    assert (None if found is None else found.kind) == kind


def test_another_tests_log_is_not_taken(pressed: Pressing) -> None:
    load = pressed.load
    assert load is not None
    half = load.with_channel(replace(load.load, values=0.5 * load.load.values))
    assert _kind(replace(pressed, load=half)) == "other_test"
    rng = np.random.default_rng(2)
    steps = 400.0 + np.cumsum(rng.normal(0.0, 20.0, len(load)))
    other = load.with_channel(replace(load.load, values=np.clip(steps, 0.0, 800.0) / max(steps.max(), 800.0) * 800.0))
    assert _kind(replace(pressed, load=other)) == "other_test"


def test_a_test_that_was_stopped_early_has_too_few_repeats(pressed: Pressing) -> None:
    load = pressed.load
    assert load is not None
    assert _kind(replace(pressed, load=load.between(0.0, 12.0))) == "too_few_repeats"


def test_a_stream_that_misses_a_part_of_the_test_is_seen(pressed: Pressing) -> None:
    stream = pressed.stream
    late = stream.between(stream.time_s[0] + 6.0, stream.time_s[-1])
    assert _kind(replace(pressed, stream=late)) == "stream_too_short"


def test_a_connection_that_was_lost_for_a_second_is_seen_and_single_samples_are_not(pressed: Pressing) -> None:
    stream = pressed.stream
    rng = np.random.default_rng(4)
    assert _kind(replace(pressed, stream=stream.taken(rng.random(len(stream)) > 0.05))) is None
    hole = (stream.time_s > stream.time_s[0] + 6.0) & (stream.time_s < stream.time_s[0] + 7.0)
    assert _kind(replace(pressed, stream=stream.taken(~hole))) == "stream_too_short"


def test_a_zero_that_moves_is_told_and_may_be_accepted(pressed: Pressing) -> None:
    # Five millibar over the session, of a span of 87.
    found = first_fault(AT_THE_END, _changed(pressed, lambda c: c.values + np.linspace(0.0, 5.0, c.values.size)))
    assert found is not None
    assert (found.kind, found.grave) == ("zero_drift", False)


def test_a_streams_time_is_that_of_its_last_sample(tmp_path: Path) -> None:
    with SessionFolder.begin(tmp_path, bench_plan()) as folder, open_shoe("sim:stand?seed=5") as shoe:
        folder.note_stream(shoe)
        stream = _Stream(shoe, folder, Unattended())
        assert stream.last_s == 0.0
        for _ in range(3):
            block = stream.next("", 0.0)
            assert block is not None
            assert stream.last_s == block.time_s[-1]


class _Counting(Unattended):
    def __init__(self) -> None:
        self.asked: list[tuple[str, int]] = []

    def wants_repeat(self, finding: PressingFault, repeats_left: int) -> bool:
        self.asked.append((finding.kind, repeats_left))
        return super().wants_repeat(finding, repeats_left)


def test_a_fault_that_stays_ends_the_session_after_the_last_repeat(tmp_path: Path) -> None:
    small = "sim:stand"  # 800 N are 85 % of the range: 1000 N are beyond it
    heavy = replace(dynamic_protocol((800.0,), peak_n=1000.0, rest_s=1.0), name="heavy")
    operator = _Counting()
    with SessionFolder.begin(tmp_path, bench_plan(shoe=small, protocols=(heavy,), largest_repeats=1)) as folder:
        with pytest.raises(RefusedError, match="pressed 2 times: left_toe reads the end of its range"):
            conduct(folder, operator)
        assert [attempt.state for attempt in folder.attempts()] == ["rejected", "rejected"]
    assert operator.asked == [("saturation", 1), ("saturation", 0)]


def test_the_wrong_unit_under_the_anvil_is_pressed_again_once_it_is_put_right(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = machine_run.machine_at

    def misplaced(url: str, shoe: Shoe, unit: str) -> machine_run.MachineSide:
        return real(url, shoe, "left_heel")

    monkeypatch.setattr("smartshoe.runs.session._procedure.machine_at", misplaced)

    class PutsItRight(_Counting):
        def wants_repeat(self, finding: PressingFault, repeats_left: int) -> bool:
            bench = shoes[0].bench  # type: ignore[attr-defined]
            bench.unit = "left_toe"
            return super().wants_repeat(finding, repeats_left)

    shoes: list[Shoe] = []

    def keeps(url: str) -> Shoe:
        shoes.append(open_shoe(url))
        return shoes[0]

    monkeypatch.setattr("smartshoe.runs.session._procedure.open_shoe", keeps)
    operator = PutsItRight()
    with SessionFolder.begin(tmp_path, bench_plan()) as folder:
        conduct(folder, operator)
        assert [attempt.state for attempt in folder.attempts()] == ["rejected", "accepted"]
    assert operator.asked == [("wrong_unit", 2)]


def test_a_recording_with_another_tests_log_is_refused_as_input(tmp_path: Path, pressed: Pressing) -> None:
    load = pressed.load
    assert load is not None
    write(pressed.stream, tmp_path / "stream.csv")
    rng = np.random.default_rng(3)
    shuffled = Recording.from_arrays(
        time_s=load.time_s, force_n=np.abs(800.0 * np.sin(np.cumsum(rng.normal(0.0, 0.05, len(load)))))
    )
    write(shuffled, tmp_path / "log.csv")
    plan = bench_plan(shoe=f"replay:{tmp_path / 'stream.csv'}", machine=f"log:{tmp_path / 'log.csv'}")
    os.utime(tmp_path / "log.csv", (1.0, 1.0))
    with SessionFolder.begin(tmp_path / "session", plan) as folder, pytest.raises(InputError, match="log of this test"):
        conduct(folder)


@pytest.mark.parametrize(("by_hand", "needed_s"), [(False, 12.0), (True, 10.0)])
def test_a_test_is_over_once_the_stream_covers_it_whenever_its_log_came(by_hand: bool, needed_s: float) -> None:
    """A machine's log may be there early; the shoe is heard to the test's end, and where nobody waited, past it."""

    class Stream:
        last_s, has_ended, is_live = 100.0, False, True

        def next(self, name: str, since_s: float) -> object:
            self.last_s += 0.5
            return object()

    stream = Stream()
    folder: Any = SimpleNamespace(plan=SimpleNamespace(tail_s=2.0, wait_s=60.0), keep_log=lambda *_: None)
    log = object()
    machine: Any = SimpleNamespace(by_hand=by_hand, columns=(), log=lambda: log if stream.last_s >= 105.0 else None)
    protocol: Any = SimpleNamespace(name="dynamic", duration_s=10.0)
    pressing = _Pressing(folder, protocol, 1, machine, stream, SimpleNamespace())  # type: ignore[arg-type]
    for _ in range(100):
        if pressing.is_over():
            break
    assert stream.last_s - 100.0 == needed_s


def test_how_far_a_reading_moves_is_a_share_of_its_range(pressed: Pressing) -> None:
    span = float(np.ptp(pressed.reading.values))
    for range_, size in (((0.0, 200.0), 200.0), ((-50.0, 150.0), 200.0), (None, 1.0)):
        assert _share(replace(pressed.reading, range_=range_)) == pytest.approx(span / size)


def test_a_second_of_a_stream_is_told_by_its_least_and_most_beside_names_and_units() -> None:
    readings = np.array([[1.0, 700.0], [4.0, 90.0], [9.0, 650.0]])
    missing = np.array([[False, False], [False, True], [True, False]])
    block = Block(np.array([0.1, 0.2, 0.3]), readings, missing, ("heel", "toe"), MILLIBAR)
    second = Seconds(block, ["toe"])
    assert second.heading.split() == ["time", "heel", "mbar", "toe", "N"]
    second.add(block, {"toe": 0.5 * readings[:, 1]})
    assert second.report(12.25).split() == ["12.2", "s", "1.0", "to", "4.0", "325.0", "to", "350.0"]
    assert second.report(13.0).split() == ["13.0", "s", "–", "–"]


@pytest.mark.parametrize("units", [1, 4, 5, 8, 16])
def test_a_second_of_many_units_is_told_in_rows_of_a_terminals_width(units: int) -> None:
    names = tuple(f"unit_{k}" for k in range(units))
    block = Block(np.zeros(1), np.full((1, units), 999.9), np.zeros((1, units), dtype=bool), names, MILLIBAR)
    second = Seconds(block, [])
    second.add(block, {})
    for told, cell in ((second.heading, "mbar"), (second.report(3599.9), "999.9 to 999.9")):
        rows = told.split("\n")
        assert max(map(len, rows)) <= 80
        assert len(rows) == -(-units // 4)
        assert sum(row.count(cell) for row in rows) == units
        # Only the first row has the time.
        assert {row[:10].strip() for row in rows[1:]} <= {""}


@pytest.mark.parametrize(("longest_s", "remembers_s"), [(0.0, 60.0), (20.0, 60.0), (120.0, 6.0)])
def test_a_unit_rests_until_it_stands_still_and_no_longer_than_the_plan_says(
    longest_s: float, remembers_s: float
) -> None:
    class Resting:
        """A unit whose reading falls by ``exp(-t / remembers_s)`` from its full range."""

        events = ()

        def describe(self) -> list[Any]:
            return [SimpleNamespace(name="left_toe", range_=(0.0, 200.0))]

        def blocks(self) -> Any:
            for time_s in np.arange(100.0, 1000.0, 0.5):
                reading = np.full((1, 1), 200.0 * np.exp(-(time_s - 100.0) / remembers_s))
                yield Block(np.array([time_s]), reading, np.zeros((1, 1), dtype=bool), ("left_toe",), MILLIBAR)

    kept: list[Block] = []
    folder: Any = SimpleNamespace(attempts=tuple, keep=kept.append, note=lambda *_, **__: None)
    operator: Any = SimpleNamespace(show=lambda *_: None)
    stream = _Stream(Resting(), folder, operator)  # type: ignore[arg-type]
    stream.next("dynamic", 0.0)
    stream.rest("dynamic", "left_toe", longest_s)
    rested_s = stream.last_s - 100.0
    if longest_s == 0.0:
        assert rested_s == 0.0
    elif remembers_s > longest_s:
        assert longest_s <= rested_s < longest_s + 6.0  # in stretches of five seconds
    else:
        # By then what is left falls by less than a ten-thousandth of the range from one stretch to the next.
        assert remembers_s * np.log(1e4) - 6.0 < rested_s < remembers_s * np.log(1e4) + 12.0
    assert [float(block.time_s[0]) for block in kept] == pytest.approx(np.arange(100.0, stream.last_s + 0.1, 0.5))
