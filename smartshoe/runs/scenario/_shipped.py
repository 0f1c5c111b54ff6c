"""The scenarios that come with smartshoe: in a checkout in ``scenarios``, in a wheel among the environment's data."""

from __future__ import annotations

import sysconfig
from pathlib import Path


def or_shipped(path: Path) -> Path:
    """``path``, or where there is no such file and it says ``scenarios/NAME.toml``, the one shipped under that name."""
    if path.parent == Path("scenarios") and not path.exists():
        for home in _homes():
            if (home / path.name).is_file():
                return home / path.name
    return path


def _homes() -> tuple[Path, ...]:
    schemes = (sysconfig.get_default_scheme(), sysconfig.get_preferred_scheme("user"))
    installed = (Path(sysconfig.get_path("data", scheme)) / "share" / "smartshoe" / "scenarios" for scheme in schemes)
    return (Path(__file__).resolve().parents[3] / "scenarios", *installed)
