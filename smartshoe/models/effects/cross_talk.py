"""A neighbouring unit's pressure in this unit's reading."""

from __future__ import annotations

from smartshoe.arrays import Array
from smartshoe.models.effects.effect import Conditions, Effect, EffectParameter
from smartshoe.models.effects.exposure import by


class CrossTalk(Effect):
    """+ chi times the neighbour's pressure, a share of this unit's full scale; inert where no neighbour was logged.

    It has no streaming inverse: a unit's filter does not see its neighbour.
    """

    name, family, stage, place = "cross_talk", "cross_talk", "sensor", "sensor"
    says = "the reading follows a neighbouring unit's pressure, also while its own load rests"
    parameters = (
        EffectParameter(
            "coupling", "FS_reading", "reading while the neighbour reads this unit's full scale", 0.0, -0.5, 0.5, 0.01
        ),
    )
    needs = frozenset({"neighbour"})
    separated_by = {
        "contact_area": by("neighbour"),
        "zero_drift": by("neighbour"),
    }
    is_seen_at_rest = True

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The signal and the neighbour's share."""
        if conditions.neighbour is None:
            return signal.copy()
        return signal + float(values[0]) * conditions.neighbour
