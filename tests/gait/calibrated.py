"""The eight units of the simulated shoes, calibrated on the simulated machine."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import smartshoe
from smartshoe.calibration import Calibration
from smartshoe.devices import open_machine
from smartshoe.protocol import Protocol, dynamic_protocol, static_protocol
from smartshoe.recording import UNITS_OF_A_SHOE, Recording

UNITS = tuple(unit for unit in UNITS_OF_A_SHOE if "_" in unit)
TRIANGLES = dynamic_protocol((100.0, 400.0, 800.0))


def _pressed(unit: str, protocol: Protocol, options: Mapping[str, Any]) -> Recording:
    with open_machine("sim:instron", unit=unit, seed=5, **options) as machine:
        return machine.run(protocol)


def eight_calibrations(**options: Mapping[str, Any]) -> list[Calibration]:
    """Triangles at three rates, a Gauss-Newton fit each; ``options`` of the machine (bladder, sensor)."""
    return [smartshoe.identify([_pressed(u, TRIANGLES, options)], method="gn").calibration() for u in UNITS]


def eight_diagnoses(**options: Mapping[str, Any]) -> list[Calibration]:
    """Staircases and triangles, diagnosed: the calibrations of the extended models."""
    found = []
    for unit in UNITS:
        recordings = [_pressed(unit, protocol, options) for protocol in (static_protocol(), TRIANGLES)]
        found.append(smartshoe.diagnose(recordings).calibration(unit=unit, sample_rate_hz=100.0))
    return found
