"""What a measurement may hold beside the standard linear solid: one file an effect, found by `catalogue`."""

from smartshoe.models.effects._sensor_evidence import NoiseEffect
from smartshoe.models.effects._sensor_inverse import Memoryless, c_number
from smartshoe.models.effects.catalogue import (
    between_clocks,
    blocks,
    catalogue,
    effect,
    in_words,
    is_told_from_its_family,
    listed,
    shift_of,
    told_apart_by,
)
from smartshoe.models.effects.effect import Conditions, CoreEffect, CStep, Effect, EffectParameter, Inverse, Place
from smartshoe.models.effects.exposure import by
from smartshoe.models.elements import Arm, Heat, Leak

__all__ = [
    "Arm",
    "CStep",
    "Conditions",
    "CoreEffect",
    "Effect",
    "EffectParameter",
    "Heat",
    "Inverse",
    "Leak",
    "Memoryless",
    "NoiseEffect",
    "Place",
    "between_clocks",
    "blocks",
    "by",
    "c_number",
    "catalogue",
    "effect",
    "in_words",
    "listed",
    "is_told_from_its_family",
    "shift_of",
    "told_apart_by",
]
