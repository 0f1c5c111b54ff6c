"""Simulated instruments that read a unit: the sensor and its logger."""
