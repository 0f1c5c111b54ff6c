"""smartshoe: calibrate, identify, compensate and diagnose shoe-embedded air pressure sensors.

Every name below is imported on first use, so that ``import smartshoe`` and ``smartshoe --help`` stay quick.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from smartshoe.version import __version__ as __version__

_HOME = {
    "Recording": "smartshoe.recording",
    "Channel": "smartshoe.recording",
    "Protocol": "smartshoe.protocol",
    "static_protocol": "smartshoe.protocol",
    "dynamic_protocol": "smartshoe.protocol",
    "read": "smartshoe.files.logs",
    "write": "smartshoe.files.logs",
    "open_shoe": "smartshoe.devices",
    "open_machine": "smartshoe.devices",
    "identify": "smartshoe.identification",
    "Identification": "smartshoe.identification",
    "identify_transfer_function": "smartshoe.identification.transfer_function",
    "select_order": "smartshoe.identification.transfer_function",
    "TransferFunctionEstimate": "smartshoe.identification.transfer_function",
    "RecursiveIdentification": "smartshoe.identification.recursive",
    "lack_of_fit": "smartshoe.identification.lack_of_fit",
    "leave_one_rate_out": "smartshoe.identification.leave_out",
    "Calibration": "smartshoe.calibration",
    "CalibrationStore": "smartshoe.calibration.store",
    "Compensator": "smartshoe.calibration",
    "compensate": "smartshoe.calibration",
    "load_calibrations": "smartshoe.calibration.folder",
    "stack": "smartshoe.calibration",
    "validate": "smartshoe.calibration.validation",
    "Validation": "smartshoe.calibration.validation",
    "GaitResult": "smartshoe.gait._result",
    "diagnose": "smartshoe.diagnosis",
    "Diagnosis": "smartshoe.diagnosis",
    "ExtendedModel": "smartshoe.models.extended",
    "sweep": "smartshoe.runs.sweeps",
    "study": "smartshoe.runs.studies",
    "SmartShoeError": "smartshoe.errors",
}

if TYPE_CHECKING:
    from smartshoe.calibration import Calibration, Compensator, compensate, stack
    from smartshoe.calibration.folder import load_calibrations
    from smartshoe.calibration.store import CalibrationStore
    from smartshoe.calibration.validation import Validation, validate
    from smartshoe.devices import open_machine, open_shoe
    from smartshoe.diagnosis import Diagnosis, diagnose
    from smartshoe.errors import SmartShoeError
    from smartshoe.files.logs import read, write
    from smartshoe.gait import GaitResult
    from smartshoe.identification import Identification, identify
    from smartshoe.identification.lack_of_fit import lack_of_fit
    from smartshoe.identification.leave_out import leave_one_rate_out
    from smartshoe.identification.recursive import RecursiveIdentification
    from smartshoe.identification.transfer_function import (
        TransferFunctionEstimate,
        identify_transfer_function,
        select_order,
    )
    from smartshoe.models.extended import ExtendedModel
    from smartshoe.protocol import Protocol, dynamic_protocol, static_protocol
    from smartshoe.recording import Channel, Recording
    from smartshoe.runs.studies import study
    from smartshoe.runs.sweeps import sweep

__all__ = [
    "Calibration",
    "CalibrationStore",
    "Channel",
    "Compensator",
    "Diagnosis",
    "ExtendedModel",
    "GaitResult",
    "Identification",
    "Protocol",
    "Recording",
    "RecursiveIdentification",
    "SmartShoeError",
    "TransferFunctionEstimate",
    "Validation",
    "compensate",
    "diagnose",
    "dynamic_protocol",
    "identify",
    "identify_transfer_function",
    "lack_of_fit",
    "leave_one_rate_out",
    "load_calibrations",
    "open_machine",
    "open_shoe",
    "read",
    "select_order",
    "stack",
    "static_protocol",
    "study",
    "sweep",
    "validate",
    "write",
]


def __getattr__(name: str) -> Any:
    if name == "gait":  # a package whose functions are called by its name: smartshoe.gait.analyse
        return importlib.import_module("smartshoe.gait")
    home = _HOME.get(name)
    if home is None:
        raise AttributeError(f"module 'smartshoe' has no attribute {name!r}")
    return getattr(importlib.import_module(home), name)


def __dir__() -> list[str]:
    return sorted(__all__)
