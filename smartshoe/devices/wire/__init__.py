"""What a shoe sends and is sent, as decoders and encoders without any input or output: see docs/wire.md."""
