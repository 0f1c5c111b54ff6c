"""Units that are taken out and put back: each recording has a gain of its own, hidden beside an effect or alone."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace

import pytest
from bank import PLAIN, within_reach
from daily import first_and_bank, first_and_long

from smartshoe.diagnosis import Diagnosis, diagnose
from smartshoe.recording import Recording

GAINS = (0.015, -0.010, 0.004, 0.007, -0.005)


def _put_back(recording: Recording, by: float) -> Recording:
    """The reading about its rest times one plus ``by``."""
    reading = recording.sensors[0]
    zero = float(reading.values[:50].mean())
    return recording.with_channel(replace(reading, values=zero + (1.0 + by) * (reading.values - zero)))


def _diagnosed(effects: dict[str, float], seed: int, recordings: int, moved: bool = True) -> Diagnosis:
    case = within_reach(effects, PLAIN[seed % len(PLAIN)], seed, recordings=recordings)
    gains = GAINS if moved else (0.0,) * len(GAINS)
    fitted = [_put_back(one, by) for one, by in zip(case.recordings, gains, strict=False)]
    return diagnose(fitted, [_put_back(one, by) for one, by in zip(case.hold_out, gains[3:], strict=False)])


def _told(found: Diagnosis) -> list[str]:
    return [said for said in found.limits if "a gain of its own" in said]


@pytest.mark.parametrize("recordings", first_and_long([2, 3], {2}))
@pytest.mark.parametrize("seed", first_and_bank([10, 11, 12, 13], {10}))
def test_gains_are_told_and_nothing_is_named_for_them(seed: int, recordings: int) -> None:
    found = _diagnosed({}, seed, recordings)
    (said,) = _told(found)
    low, high = (float(one) for one in re.findall(r"([+-][0-9.]+) % in", said))
    # Two recordings' gains lie 1.25 % on either side of their mean, three's from -1.3 to 1.2 %; small imperfections
    # of the unit move that.
    assert low == pytest.approx(-1.27, abs=0.35)
    assert high == pytest.approx(1.22, abs=0.35)
    assert not [cause.name for cause in found.causes if cause.confidence > 0.5 and cause.size > 1.5e-3]


@pytest.mark.parametrize("recordings", first_and_bank([2, 3], {2}))
@pytest.mark.parametrize(
    "named",
    [
        ("mullins_softening", "softening"),
        pytest.param(("wall_hardening", "static_curve"), marks=pytest.mark.long),
        *first_and_bank(
            [
                ("play_hysteresis", "hysteresis"), ("second_relaxation", "relaxation"),
                ("gain_drift", "gain_drift"), ("linear_leak", "leak"),
            ],
            {},
        ),
    ],
)  # fmt: skip
def test_an_effect_is_named_beside_gains(named: tuple[str, str], recordings: int) -> None:
    """Without the gains, two recordings that differ let no effect stand: it is not the same in both."""
    name, family = named
    found = _diagnosed({name: 1.0}, 14, recordings)
    assert _told(found)
    assert family in {cause.effect.family for cause in found.causes if cause.confidence > 0.5}


@pytest.mark.parametrize(
    "effects",
    first_and_long(
        [{}, {"wall_hardening": 1.0}, {"gain_drift": 1.0}, {"cycle_conditioning": 1.0}], [{}, {"gain_drift": 1.0}]
    ),
)
@pytest.mark.parametrize("seed", first_and_bank([20, 21, 22], {20}))
def test_a_unit_that_stays_in_place_is_told_no_gains(effects: dict[str, float], seed: int) -> None:
    assert not _told(_diagnosed(effects, seed, 2, moved=False))


@pytest.mark.parametrize(
    ("seeds", "least"),
    [
        ((31,), 1),
        pytest.param((32,), 1, marks=pytest.mark.long),
        pytest.param(range(30, 38), 6, marks=pytest.mark.bank),
    ],
)
def test_a_gain_that_changes_at_a_moment_is_told_with_it_and_is_no_drift(seeds: Iterable[int], least: int) -> None:
    """Three of four at least; between triangles and holds, cycles that condition may do the same."""
    told = 0
    for seed in seeds:
        case = within_reach({"gain_step": 1.0}, PLAIN[seed % len(PLAIN)], seed, recordings=2)
        found = diagnose(case.recordings, case.hold_out)
        at_s = case.options["sensor"]["wander"]["gain_step_at_s"]
        said = " ".join(one for one in found.limits if one.startswith("the gain changes"))
        moments = [(one, one) for one in re.findall(r"at ([0-9.]+) s", said)]
        moments += re.findall(r"between ([0-9.]+) and ([0-9.]+) s", said)  # a rest, in which no gain is seen
        is_told = any(float(first) - 10.0 < at_s < float(last) + 10.0 for first, last in moments)
        told += is_told
        if is_told:
            assert not [one.name for one in found.causes if one.effect.needs_cycles and one.confidence > 0.5]
    assert told >= least
