"""Hidden effects: a neighbour's reading leaking into this one; `simulators.effects.room` has the coupling."""

from __future__ import annotations

from simulators.hidden.effects._law import Law
from simulators.hidden.effects._registry import Draws, Hideable, Options, Subject, uniform


def neighbour(amount: float, draws: Draws, subject: Subject) -> Options:
    """Machine options with a logged neighbour whose coupling is ``amount``."""
    given = {"highest_mbar": subject.full_scale_mbar, "noise_mbar": 0.001 * subject.full_scale_mbar}
    coupling = {key: draws[key] for key in ("lag_s", "from_share") if key in draws}
    return {"neighbour": {"logged": True, "cross_talk": amount, "period_s": draws["period_s"], **given, **coupling}}


EFFECTS = [
    Hideable("cross_talk", "cross_talk", "sensor", "cross_talk", "1", 0.01, 1.0, neighbour,
        uniform(period_s=(2.0, 5.0)), law="proportional",
        says="a share of the neighbour's pressure", source="common supply",
        catalogue=lambda a, d, s, hz: {"coupling_mbar": a * s.full_scale_mbar},  # at the neighbour's largest pressure
        laws=(
            Law.of_options("lagged", "through a lag: along the insole", "first order", neighbour, 0.01, 1.0,
                           uniform(period_s=(2.0, 5.0), lag_s=(0.1, 0.5))),
            Law.of_options("touching", "only above the pressure at which the neighbour touches", "contact", neighbour,
                           0.02, 1.0, uniform(period_s=(2.0, 5.0), from_share=(0.1, 0.4))),
        )),
]  # fmt: skip
