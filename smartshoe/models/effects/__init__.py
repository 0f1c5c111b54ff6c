"""What a measurement may hold beside the standard linear solid: one file an effect, found by `catalogue`."""

from smartshoe.models.effects._sensor_evidence import NoiseEffect
from smartshoe.models.effects._sensor_inverse import Memoryless, c_number
from smartshoe.models.effects.catalogue import (
    between_clocks,
    blocks,
    catalogue,
    effect,
    failure_of_others,
    in_words,
    is_told_from_its_family,
    listed,
    origin_of,
    refuse_other_size,
    shift_of,
    told_apart_by,
    why_not_known,
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
    "failure_of_others",
    "in_words",
    "listed",
    "is_told_from_its_family",
    "origin_of",
    "refuse_other_size",
    "shift_of",
    "told_apart_by",
    "why_not_known",
]
