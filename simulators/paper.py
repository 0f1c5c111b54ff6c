"""The numbers that Chinimilli 2016 prints: constants (Section IV) and Tables 1 and 2, as data."""

from __future__ import annotations

MOLES, GAS_CONSTANT, TEMPERATURE_K, DIAMETER_M = 4.2075e-9, 8.3145, 300.0, 2e-3
AMBIENT_PA = 101_325.0
PEAK_N = 800.0

# Table 1 (c = 1): k1, k2, then the printed (num0 z + num1)/(z + den1) at 100 Hz.
TABLE_1: dict[str, tuple[float, float, float, float, float]] = {
    "right_toe": (1.873, 0.119, 2.269, -2.267, -0.9988),
    "right_heel": (2.045, 0.159, 2.284, -2.281, -0.9984),
    "left_toe": (1.341, 0.215, 2.224, -2.221, -0.9979),
    "left_heel": (2.025, 0.316, 2.355, -2.349, -0.9968),
}

# Table 2: by unit, (rate N/s, RMSE raw N, RMSE filtered N, P %).
TABLE_2: dict[str, tuple[tuple[float, float, float, float], ...]] = {
    "right_toe": (
        (100, 137.059, 43.992, 67.9),
        (200, 140.291, 47.883, 65.87),
        (400, 144.217, 54.123, 62.47),
        (800, 144.514, 56.205, 61.11),
    ),
    "right_heel": (
        (100, 103.999, 31.421, 69.79),
        (200, 108.437, 33.076, 69.50),
        (400, 111.274, 35.625, 67.98),
        (800, 113.595, 38.2441, 66.33),
    ),
    "left_toe": (
        (100, 224.283, 55.272, 75.36),
        (200, 232.154, 64.159, 72.36),
        (400, 238.448, 73.185, 69.31),
        (800, 239.654, 76.0494, 68.27),
    ),
    "left_heel": (
        (100, 158.164, 37.435, 76.33),
        (200, 196.177, 54.354, 72.29),
        (400, 250.127, 74.259, 70.31),
        (800, 283.381, 88.221, 68.87),
    ),
}
