"""What comes with smartshoe beside its code: in a checkout its folders, in a wheel among the environment's data."""

from __future__ import annotations

import sysconfig
from pathlib import Path


def shipped(name: str) -> Path | None:
    """The file or folder ``name`` ("docs", "scenarios/calibration.toml") as it was shipped, None where it is not."""
    schemes = (sysconfig.get_default_scheme(), sysconfig.get_preferred_scheme("user"))
    installed = (Path(sysconfig.get_path("data", scheme)) / "share" / "smartshoe" for scheme in schemes)
    checkout = Path(__file__).resolve().parents[2]  # of a wheel this is where other packages are too
    homes = (*([checkout] if (checkout / "pyproject.toml").is_file() else []), *installed)
    return next((home / name for home in homes if (home / name).exists()), None)
