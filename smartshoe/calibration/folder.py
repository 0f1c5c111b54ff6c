"""Finds calibrations as users have them: objects, files written by ``identify``, ``diagnose`` and ``run``, folders."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import TypeAlias, Union

from smartshoe.calibration._calibration import Calibration, calibration_from
from smartshoe.calibration.store import is_store
from smartshoe.errors import InputError

CalibrationsLike: TypeAlias = Union[Calibration, str, "os.PathLike[str]"]


def load_calibrations(given: CalibrationsLike | Iterable[CalibrationsLike]) -> list[Calibration]:
    """The calibrations in files and folders; in a folder a unit's extended one stands for its plain one.

    Parameters
    ----------
    given
        The path of a calibration file or of a folder of them, a `Calibration`, or several of these.

    Raises
    ------
    InputError
        For a file that is no calibration, and a folder that holds none or is a store.
    UsageError
        For anything else, naming its type.

    Examples
    --------
    >>> import smartshoe
    >>> from smartshoe.units import MILLIBAR
    >>> heel = smartshoe.Calibration(a1=0.2, b0=5.2, b1=1.0, reading_unit=MILLIBAR, unit="left_heel")
    >>> heel.save("left_heel.json")
    >>> [calibration.unit for calibration in smartshoe.load_calibrations(".")]
    ['left_heel']
    """
    if isinstance(given, (Calibration, str, os.PathLike)) or not isinstance(given, Iterable):
        given = [given]
    found: list[Calibration] = []
    for one in given:
        if isinstance(one, (str, os.PathLike)) and Path(one).is_dir():
            found += _of_folder(Path(one))
        else:
            found.append(calibration_from(one, "calibrations"))
    return found


def _of_folder(folder: Path) -> list[Calibration]:
    if is_store(folder):  # a store may contain several calibrations of a unit, for different days
        raise InputError(
            f"{folder} is a store: take each unit's calibration out of it, smartshoe calibrations show UNIT"
            f" --out C.json --store {folder}"
        )
    inside = [Calibration.load(file) for file in sorted(folder.glob("*.json"))]
    if not inside:
        raise InputError(f"{folder} holds no calibration: give a folder with .json files that identify wrote")
    extended = {each.unit for each in inside if each.extended is not None}
    return [each for each in inside if each.extended is not None or each.unit not in extended]
