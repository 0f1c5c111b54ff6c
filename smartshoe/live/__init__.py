"""The live display: a worn shoe's stream is recorded, sent to LSL and shown on a page that a local server provides."""
