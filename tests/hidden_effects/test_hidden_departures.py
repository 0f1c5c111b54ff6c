"""What a law has beyond the equation of its effect is told as no effect beside it."""

from __future__ import annotations

import pytest

from simulators.hidden.cases import case
from smartshoe.diagnosis import diagnose


@pytest.mark.parametrize("law", [0, 1])
def test_a_gain_that_settles_more_at_some_loads_is_no_bent_sensor(law: int) -> None:
    """Walls that settle exponentially and by the way of their load, each not alike at all loads: 21 and 38 % beside.

    What differs is a curve of the load, since all of the gain departs and not the part alone that changes.
    """
    made = case("worlds", 63 + law)
    (hidden,) = made.hidden
    assert hidden.effect.name == "cycle_conditioning"
    found = diagnose(made.recordings, made.hold_out)
    assert found.causes[0].name == "cycle_conditioning"
    assert "static_curve" not in {one.effect.family for one in found.causes}
    assert found.verdict == "explained"
