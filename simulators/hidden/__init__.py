"""Units with an effect that the engine does not know of."""
