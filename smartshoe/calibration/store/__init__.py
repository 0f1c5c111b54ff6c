"""A store of calibrations over the life of units: a folder of plain files, searched by serial number, place, date."""

from smartshoe.calibration.store._calibration_store import CalibrationStore, default_folder, find, is_store
from smartshoe.calibration.store._entry import Entry, Found, HistoryEvent

__all__ = ["CalibrationStore", "Entry", "HistoryEvent", "Found", "default_folder", "find", "is_store"]
