"""smartshoe: calibrate, identify, compensate and diagnose shoe-embedded air pressure sensors.

Every name below is imported on first use, so that ``import smartshoe`` and ``smartshoe --help`` stay quick.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

_HOME = {
    "Recording": "smartshoe.recording",
    "Channel": "smartshoe.recording",
    "Protocol": "smartshoe.protocol",
    "static_protocol": "smartshoe.protocol",
    "dynamic_protocol": "smartshoe.protocol",
    "read": "smartshoe.logs",
    "write": "smartshoe.logs",
    "open_shoe": "smartshoe.devices",
    "open_machine": "smartshoe.devices",
    "identify": "smartshoe.identification",
    "Identification": "smartshoe.identification",
    "Calibration": "smartshoe.compensation",
    "Compensator": "smartshoe.compensation",
    "stack": "smartshoe.compensation",
    "validate": "smartshoe.validation",
    "SmartShoeError": "smartshoe.errors",
}

if TYPE_CHECKING:
    from smartshoe.compensation import Calibration, Compensator, stack
    from smartshoe.devices import open_machine, open_shoe
    from smartshoe.errors import SmartShoeError
    from smartshoe.identification import Identification, identify
    from smartshoe.logs import read, write
    from smartshoe.protocol import Protocol, dynamic_protocol, static_protocol
    from smartshoe.recording import Channel, Recording
    from smartshoe.validation import validate

__all__ = [
    "Calibration",
    "Channel",
    "Compensator",
    "Identification",
    "Protocol",
    "Recording",
    "SmartShoeError",
    "dynamic_protocol",
    "identify",
    "open_machine",
    "open_shoe",
    "read",
    "stack",
    "static_protocol",
    "validate",
    "write",
]


def __getattr__(name: str) -> Any:
    home = _HOME.get(name)
    if home is None:
        raise AttributeError(f"module 'smartshoe' has no attribute {name!r}")
    return getattr(importlib.import_module(home), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *_HOME])
