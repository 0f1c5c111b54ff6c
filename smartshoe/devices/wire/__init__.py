"""Decoders and encoders of what a shoe sends and receives, without any input or output; specified in docs/wire.md."""
