"""Friction that grows with the load and friction that does not, hidden together: neither need be the other's error."""

from __future__ import annotations

from collections.abc import Iterable

import pytest

from simulators.hidden.recordings import hide
from smartshoe.diagnosis import diagnose

FRICTION = {"play_hysteresis", "bouc_wen_hysteresis", "load_unload_asymmetry"}
LOOPS = ("play_hysteresis", "bouc_wen_hysteresis")
PROTOCOLS = ("mixed", "shuffled")


@pytest.mark.parametrize(
    ("seeds", "least"),
    [
        ((30,), 1),
        pytest.param((28, 31), 1, marks=pytest.mark.long),  # the other loop, and the other protocol
        pytest.param(range(28, 34), 3, marks=pytest.mark.bank),
    ],
)
def test_a_loop_and_an_asymmetry_of_one_size_are_named_both_where_neither_law_follows_the_other(
    seeds: Iterable[int], least: int
) -> None:
    """Where a loop's law takes up most of the asymmetry, that stays in the model: one of them is named at least."""
    both = 0
    for seed in seeds:
        case = hide({LOOPS[seed // 2 % 2]: 1.5, "load_unload_asymmetry": 1.5}, protocol=PROTOCOLS[seed % 2], seed=seed)
        found = diagnose(case.recordings, case.hold_out)
        sure = {cause.name for cause in found.causes if cause.confidence > 0.5 and cause.size > 1.5e-3}
        assert sure & FRICTION
        assert len(FRICTION & {*sure, *found.minor}) == 2
        both += len(sure & FRICTION) == 2
        assert found.gain is not None
        assert found.gain.gain_percent > 60.0
    assert both >= least  # none, where the surer of the two is named alone
