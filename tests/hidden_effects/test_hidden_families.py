"""Two effects of one family that may be there together: a set beside a warm-up, a delay beside a drift."""

from __future__ import annotations

import pytest
from daily import first_and_bank, first_and_long

from simulators.hidden.plans import ONE_FAMILY
from simulators.hidden.recordings import hide
from smartshoe.diagnosis import diagnose

PROTOCOLS = ("mixed", "shuffled")
IMITATE = frozenset({"delay", "sensor_lag"})  # a lag of a tenth of a second is late by as much as a delay, edges aside

DAILY = (("mullins_softening", "cycle_conditioning"),)


# A second relaxation at the end of its kind, 120 s, takes the set's part, and what goes with it is not sure.
MISSED = pytest.mark.xfail(reason="a second relaxation at the end of its kind takes the set's part", strict=True)


@pytest.mark.parametrize("seed", first_and_bank([11, 12], {11}))
@pytest.mark.parametrize(
    "pair", first_and_long([pair for pair in ONE_FAMILY if {*pair} != IMITATE], DAILY), ids="-".join
)
def test_both_are_named_and_the_model_follows_both(
    pair: tuple[str, str], seed: int, request: pytest.FixtureRequest
) -> None:
    if ({*pair}, seed) == ({"permanent_set", "zero_drift"}, 12):
        request.applymarker(MISSED)
    case = hide(pair, protocol=PROTOCOLS[seed % 2], seed=seed, recordings=3)
    found = diagnose(case.recordings, case.hold_out)
    assert found.verdict == "explained"
    assert {*pair} <= {cause.name for cause in found.causes}
    assert found.explainable_percent is not None
    assert found.explained_percent is not None
    assert found.explained_percent > 0.9 * found.explainable_percent


@pytest.mark.long
def test_a_delay_and_a_lag_leave_nothing_where_one_stands_for_both() -> None:
    case = hide(sorted(IMITATE), protocol="multisine", seed=11, recordings=3)
    found = diagnose(case.recordings, case.hold_out)
    assert {cause.name for cause in found.causes} & IMITATE
    assert found.explainable_percent is not None
    assert found.explained_percent is not None
    assert found.explained_percent > 0.9 * found.explainable_percent
