"""Finds files shipped with smartshoe besides its code: in a checkout's folders, or in a wheel's shared data."""

from __future__ import annotations

import sysconfig
from pathlib import Path


def shipped(name: str) -> Path | None:
    """The path of the shipped file or folder ``name`` ("docs", "scenarios/calibration.toml"), or None."""
    schemes = (sysconfig.get_default_scheme(), sysconfig.get_preferred_scheme("user"))
    installed = (Path(sysconfig.get_path("data", scheme)) / "share" / "smartshoe" for scheme in schemes)
    checkout = Path(__file__).resolve().parents[2]  # for a wheel, the folder of all installed packages
    homes = (*([checkout] if (checkout / "pyproject.toml").is_file() else []), *installed)
    return next((home / name for home in homes if (home / name).exists()), None)
