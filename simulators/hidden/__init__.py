"""Units with an effect that nobody told the engine of."""
