"""A folder of calibration files, as ``identify``, ``diagnose`` and ``run`` write them."""

from __future__ import annotations

from pathlib import Path

from smartshoe.calibration.calibration import Calibration
from smartshoe.errors import InputError


def load_folder(folder: Path | str) -> list[Calibration]:
    """The calibrations in a folder; a unit's extended one stands for its plain one.

    Raises `InputError` for a folder that holds none.
    """
    inside = [Calibration.load(file) for file in sorted(Path(folder).glob("*.json"))]
    if not inside:
        raise InputError(f"{folder} holds no calibration: give a folder with .json files that identify wrote")
    extended = {each.unit for each in inside if each.extended is not None}
    return [each for each in inside if each.extended is not None or each.unit not in extended]
