"""The simulated bladder: wall, gas and contact, integrated at a fine step."""
