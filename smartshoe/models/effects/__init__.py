"""What a measurement may hold beside the standard linear solid: one file an effect, found by `catalogue`."""

from smartshoe.models.effects.catalogue import blocks, catalogue, effect
from smartshoe.models.effects.effect import Conditions, Effect, EffectParameter, Inverse, Place

__all__ = ["Conditions", "Effect", "EffectParameter", "Inverse", "Place", "blocks", "catalogue", "effect"]
