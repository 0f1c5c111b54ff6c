"""What an experiment shows, what it lacks, and what is proposed next, against what is known beforehand."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from courses import STANDARD, STEP_S, prepared, pressed, triangles
from numpy.typing import NDArray
from test_diagnosis_parts import MODEL, likelihood_of, recording, sessions_of

from smartshoe import Protocol, Recording, diagnose
from smartshoe.diagnosis._baseline import baseline_of
from smartshoe.diagnosis._excitation import Excitation, excitation_of
from smartshoe.diagnosis._experiments import EXPERIMENTS, paced
from smartshoe.diagnosis._likelihood import fit
from smartshoe.diagnosis._next_experiment import _channel, _in_place_of, _protocol_for_missing_excitation
from smartshoe.diagnosis._prepared import prepared as made_ready
from smartshoe.diagnosis._ranges import ranges_of
from smartshoe.diagnosis._sensitivity import logged_words
from smartshoe.files.gate import limits
from smartshoe.integrity import examine
from smartshoe.models.effects import effect
from smartshoe.models.effects.exposure import SAYS, Exposure

Array = NDArray[np.float64]


# -- what an experiment shows -------------------------------------------------------------------------------------
def _shown(load: Array, step_s: float = STEP_S) -> Excitation:
    return excitation_of(prepared(pressed(load, step_s=step_s))[0], STANDARD)


def _course(*corners: tuple[float, float]) -> Array:
    """A load that goes in a straight line for each (seconds, share)."""
    parts, at = [np.zeros(1)], 0.0
    for seconds, share in corners:
        parts.append(np.linspace(at, share, round(seconds / STEP_S) + 1)[1:])
        at = share
    return np.concatenate(parts)


RISE = ((2.0, 1.0), (2.0, 0.0), (2.0, 0.0))


def _heights(*peaks: float) -> tuple[tuple[float, float], ...]:
    return tuple(corner for peak in peaks for corner in ((2.0, peak), (2.0, 0.0), (2.0, 0.0)))


@pytest.mark.parametrize("samples", [6, 8, 12, 24, 60])
def test_short_ramps_of_one_rate_to_many_heights_are_of_one_rate(samples: int) -> None:
    """However few samples a rise to the full load has."""
    heights = (1.0, 0.7, 1.0, 0.5, 0.85, 1.0, 0.6)
    corners = [(samples * peak * STEP_S, share) for peak in heights for share in (peak, 0.0)]
    assert "rates" not in _shown(_course((1.0, 0.0), *corners, (1.0, 0.0))).present


@pytest.mark.parametrize(
    ("word", "without", "corners"),
    [
        ("rates", RISE * 3, RISE * 2 + ((6.0, 1.0), (6.0, 0.0), (2.0, 0.0)) * 2),
        ("peaks", RISE * 3, RISE * 2 + ((1.0, 0.5), (1.0, 0.0), (2.0, 0.0)) * 2),
        ("steps", RISE * 3, ((2.0, 0.0), (0.2, 1.0), (4.0, 1.0), (0.2, 0.0), (4.0, 0.0)) * 3),
        ("holds", RISE * 3, ((2.0, 1.0), (6.0, 1.0), (2.0, 0.0), (2.0, 0.0)) * 2),
        ("idle", RISE * 3, (*RISE, (90.0, 0.0), *RISE)),
        ("pauses", RISE * 4, (*RISE, (20.0, 0.0), *RISE, *RISE, *RISE)),
        ("repeats", ((2.0, 1.0), (2.0, 0.0), (2.0, 0.0), (9.0, 0.5), (2.0, 0.0), (2.0, 0.0)), RISE * 3),
        ("minor_loops", RISE * 3, (*RISE, (2.0, 1.0), (1.0, 0.5), (1.0, 1.0), (2.0, 0.0), (2.0, 0.0))),
        ("rests", ((2.0, 1.0), (2.0, 0.3)) * 4, RISE * 3),
        ("shuffled_loads", _heights(0.25, 0.5, 0.75, 1.0), _heights(0.5, 1.0, 0.25, 0.75)),
    ],
)
def test_what_an_experiment_shows(
    word: str, without: tuple[tuple[float, float], ...], corners: tuple[tuple[float, float], ...]
) -> None:
    assert word not in _shown(_course((2.0, without[-1][1]), *without)).present
    assert word in _shown(_course((2.0, corners[-1][1]), *corners)).present


def test_rates_peaks_and_repeats_are_those_of_the_rises() -> None:
    found = _shown(_course((2.0, 0.0), *RISE * 3, *((4.0, 0.5), (4.0, 0.0), (2.0, 0.0)) * 2))
    assert found.rates_per_s == pytest.approx([0.125, 0.5], rel=0.05)
    assert found.peaks == pytest.approx([0.5, 1.0], abs=0.04)
    assert "repeats" in found.present
    # A stray first ramp makes no second rate.
    many = _shown(_course((2.0, 0.0), (4.0, 1.0), (2.0, 0.0), (2.0, 0.0), *RISE * 8))
    assert many.rates_per_s == pytest.approx([0.5], rel=0.05)


def test_what_is_lacking_is_said_and_nothing_else() -> None:
    poor = _shown(_course((2.0, 0.3), (2.0, 1.0), (2.0, 0.3)))
    said = " | ".join(poor.limits())
    for words in ("one loading rate only", "no hold longer", "never seen at rest", "no load cycle is repeated"):
        assert words in said
    shown = frozenset({"holds", "rests", "repeats", "peaks", "shuffled_loads"})
    rich = Excitation((0.1, 0.5), (0.5, 1.0), shown, STANDARD)
    assert rich.limits() == []
    assert len(replace(rich, peaks=(1.0,)).limits()) == 1
    assert "one peak load only" in replace(rich, peaks=(1.0,)).limits()[0]


def test_loads_that_grow_with_the_clock_are_told_unless_it_begins_anew_with_each() -> None:
    growing = _course((2.0, 0.0), *_heights(0.25, 0.5, 0.75, 1.0))
    assert any("grow, or fall, with time" in limit for limit in _shown(growing).limits())
    apart = [_course((2.0, 0.0), *_heights(*[peak] * 3)) for peak in (0.25, 0.5, 1.0)]
    each = excitation_of(prepared(*(pressed(load) for load in apart))[0], STANDARD)
    assert "peaks" in each.present
    assert not any("grow, or fall, with time" in limit for limit in each.limits())


# -- narrow ranges ------------------------------------------------------------------------------------------------
def _ranges(load: Array, reading: Array) -> Any:
    sessions, scale = prepared(pressed(load, reading))
    return ranges_of(sessions, baseline_of(sessions, scale), scale, STANDARD)


def test_a_narrow_range_is_told_in_newtons_and_with_its_gain_both_ways() -> None:
    load = 0.7 + 0.2 * triangles()
    (said,) = _ranges(load, 0.5 * load).says
    low, high = map(float, re.findall(r"\(([\d.]+) to ([\d.]+) N", said)[0])
    assert (low, high) == (pytest.approx(560.0, abs=3.0), pytest.approx(716.0, abs=6.0))
    gain, inverse = float(re.findall(r"by ([\d.]+) mbar/N", said)[0]), float(re.findall(r"\(([\d.]+) N/mbar", said)[0])
    assert gain == pytest.approx(0.5 * 140.0 / 800.0, rel=0.01)
    assert inverse == pytest.approx(800.0 / 70.0, rel=0.01)
    assert "extrapolated" in said
    trap = _ranges(load, 0.1 * load + 2.0)
    assert trap.is_trap
    through = float(re.findall(r"reading over load is ([\d.]+) mbar/N", trap.says[0])[0])
    assert through == pytest.approx(float(np.mean(0.1 * load + 2.0) / np.mean(load)) * 140.0 / 800.0, rel=0.02)


# -- what to run next ---------------------------------------------------------------------------------------------
def _lacking(*words: str) -> Excitation:
    every = {"rates", "holds", "rests", "minor_loops", "peaks", "shuffled_loads", "pauses", "steps"}
    return Excitation((0.1,), (1.0,), frozenset(every - set(words)), STANDARD)


@pytest.mark.parametrize(
    ("word", "protocol"),
    [
        ("rates", "rates"),
        ("holds", "holds_at_several_loads"),
        ("rests", "idle"),
        ("minor_loops", "minor_loops"),
        ("shuffled_loads", "shuffled_loads"),
        ("pauses", "pauses"),
        ("steps", "steps"),
    ],
)
def test_what_was_never_shown_is_run_next(word: Exposure, protocol: str) -> None:
    found: Any = type("Found", (), {"fit": type("F", (), {"model": MODEL})})
    told = _protocol_for_missing_excitation(found, (), _lacking(word), STEP_S)
    assert told.protocol == protocol
    assert told.steps is not None
    assert (told.steps.name, told.steps.peak_load_n) == (protocol, pytest.approx(800.0, rel=0.06))
    assert told.says == (
        f"run the protocol {protocol.replace('_', ' ')}: this data lacks {SAYS[word]}, which tell kinds of"
        " effects apart"
    )
    assert _protocol_for_missing_excitation(found, (), _lacking(), STEP_S).protocol == "repeat"
    # It shows what it is run for.
    step_s = 0.01 if word == "steps" else STEP_S
    load = told.steps.load_at(np.arange(0.0, told.steps.duration_s, step_s)) / 800.0
    assert word in _shown(load, step_s).present


def test_where_peaks_go_with_the_clock_they_are_shuffled_first() -> None:
    """That alone leaves every cause half sure; of one peak load it is as good as what else is lacking."""
    found: Any = type("Found", (), {"fit": type("F", (), {"model": MODEL})})
    assert (
        _protocol_for_missing_excitation(found, (), _lacking("rates", "steps", "shuffled_loads"), STEP_S).protocol
        == "shuffled_loads"
    )
    assert (
        _protocol_for_missing_excitation(
            found, (), _lacking("rates", "steps", "shuffled_loads", "peaks"), STEP_S
        ).protocol
        == "rates"
    )


def test_of_what_lacks_that_comes_first_which_tells_the_pair() -> None:
    found: Any = type("Found", (), {"fit": type("F", (), {"model": MODEL})})
    lacking = "rates", "rests", "pauses", "steps"
    told = {
        rivals: _protocol_for_missing_excitation(found, rivals, _lacking(*lacking), STEP_S).protocol
        for rivals in ((), ("delay", "sensor_lag"))
    }
    assert told == {(): "rates", ("delay", "sensor_lag"): "steps"}
    clocked = _lacking(*lacking, "shuffled_loads")
    assert (
        _protocol_for_missing_excitation(found, ("delay", "sensor_lag"), clocked, STEP_S).protocol == "shuffled_loads"
    )


@pytest.mark.parametrize(
    ("channel", "pair", "logged"),
    [
        ("temperature", ("gain_drift", "cycle_conditioning"), {"temperature_k": 300.0}),
        ("displacement", ("contact_area", "gas_compression"), {"displacement_mm": 1.0}),
        ("neighbour", ("cross_talk", "zero_drift"), {"left_toe_mbar": 1.0}),
    ],
)
def test_a_channel_that_tells_two_apart_is_asked_for_unless_it_is_logged(
    channel: str, pair: tuple[str, str], logged: dict[str, float]
) -> None:
    load = triangles()
    plain, _ = prepared(pressed(load))
    assert _channel(*pair, plain) == channel
    assert _channel("delay", "sensor_lag", plain) is None
    assert channel not in logged_words(plain)
    columns = {name: value + 0.0 * load for name, value in logged.items()}
    more = Recording.from_arrays(
        time_s=STEP_S * np.arange(load.size), force_n=800.0 * load, pressure_mbar=140.0 * load, **columns
    )
    assert _channel(*pair, prepared(more)[0]) is None
    # Nor does a cause of such loads lack it.
    assert channel in made_ready([more], 1, examine([more], STANDARD), STANDARD).excitation.channels


def test_a_rival_is_fitted_in_the_place_of_an_effect() -> None:
    truth = MODEL.with_part(effect("sensor_lag"), np.array([0.05, 0.0]))
    sessions, _ = sessions_of(recording(truth))
    likelihood = likelihood_of(sessions)
    found: Any = type("Found", (), {"fit": fit(likelihood, truth)})
    rival = _in_place_of(found, "sensor_lag", "delay")
    assert rival.model.names == ("delay",)
    assert rival.model.parts[0].values[0] == pytest.approx(0.05, rel=0.2)  # late by as much


# -- protocols ----------------------------------------------------------------------------------------------------
def _holds(protocol: Protocol, kind: str = "hold") -> list[tuple[float, float]]:
    found, at = [], 0.0
    for segment in protocol.segments:
        if segment.kind == kind or (kind == "hold" and segment.load_n == at > 0.0):
            found.append((segment.load_n, segment.duration_s))
        at = segment.load_n
    return found


def _peaks(protocol: Protocol) -> list[float]:
    loads = [0.0, *(segment.load_n for segment in protocol.segments if segment.kind == "ramp"), 0.0]
    return [b for a, b, c in zip(loads, loads[1:], loads[2:], strict=False) if a < b > c]


def _rates(protocol: Protocol) -> set[float]:
    """Of all ramps, full scales of 800 N a second."""
    found, at = set(), 0.0
    for segment in protocol.segments:
        if segment.kind == "ramp":
            found.add(round(abs(segment.load_n - at) / segment.duration_s / 800.0, 6))
        at = segment.load_n
    return found


def test_protocols_are_what_they_say() -> None:
    made = {name: make(800.0) for name, make in EXPERIMENTS.items()}
    assert _holds(made["long_hold"]) == [(600.0, 300.0)]
    assert max(seconds for _, seconds in _holds(made["long_hold"], "rest")) == 300.0
    assert _holds(made["holds_at_several_loads"]) == [(200.0, 90.0), (800.0, 90.0), (400.0, 90.0), (600.0, 90.0)]
    assert [s for _, s in _holds(made["holds_at_several_loads"], "rest") if s > 3.0] == [30.0] * 4
    assert _peaks(made["idle"]) == [800.0] * 6
    assert max(seconds for _, seconds in _holds(made["idle"], "rest")) == 600.0
    assert [s for _, s in _holds(made["pauses"], "rest") if s != 2.0] == [5.0, 120.0, 20.0, 300.0, 5.0]
    assert _peaks(made["pauses"]) == [800.0] * 15
    assert {seconds for _, seconds in _holds(made["steps"])} == {4.0}
    assert _rates(made["rates"]) == {0.0625, 0.125, 0.25, 0.5, 1.0}
    assert _peaks(made["rates"]) == [800.0] * 15
    assert _rates(made["minor_loops"]) == {0.1, 0.4}
    assert len(_rates(made["shuffled_loads"])) == 1
    assert _rates(made["long_hold"]) == {0.25, round(1 / 3, 6)}


@pytest.mark.long
def test_a_slow_log_is_asked_for_protocols_of_its_own_pace() -> None:
    """As one that logs every two minutes: a protocol of a minute has no course there.

    It ended in "steps holds one sample", of a protocol that nobody had given; then ramps of a second were proposed.
    """
    one = recording(MODEL.with_part(effect("wall_hardening"), effect("wall_hardening").begun(sizes=1.0)))
    found = diagnose(replace(one, time_s=5000.0 * one.time_s))
    assert found.causes
    assert found.next_experiment is not None
    if found.next_experiment.steps is not None:
        assert found.next_experiment.steps.duration_s >= 100.0 * 5000.0 * one.sample_time_s


@pytest.mark.parametrize("name", EXPERIMENTS)
@pytest.mark.parametrize("sample_time_s", [0.01, 0.2, 1.0, 150.0])
def test_a_log_shows_a_protocol_that_is_asked_for(name: str, sample_time_s: float) -> None:
    """Of its ramps over all the load it has samples; where it has them of the usual protocol, that is the one."""
    usual = EXPERIMENTS[name](800.0)
    protocol = paced(usual, sample_time_s, STANDARD)
    assert (protocol is usual) is (sample_time_s <= 0.2)
    assert protocol.duration_s >= (1.0 - 1e-9) * 100.0 * sample_time_s
    slower = protocol.duration_s / usual.duration_s
    assert [one.duration_s for one in protocol.segments] == pytest.approx(
        [slower * one.duration_s for one in usual.segments]
    )
    if name not in ("steps", "multisine"):  # whose loads change at once
        assert protocol.peak_load_n / protocol.peak_rate_n_per_s >= (1.0 - 1e-9) * 5.0 * sample_time_s
    assert slower <= 10.0 * max(sample_time_s, 0.1)
    assert paced(usual, 1e5, STANDARD).duration_s == pytest.approx(limits().duration_s)  # and no longer than any may


def test_a_protocol_goes_with_its_load() -> None:
    """The same in time, and so many times the load."""
    for make in EXPERIMENTS.values():
        one, two = make(400.0), make(800.0)
        assert [s.duration_s for s in one.segments] == pytest.approx([s.duration_s for s in two.segments])
        assert [2.0 * s.load_n for s in one.segments] == pytest.approx([s.load_n for s in two.segments])
