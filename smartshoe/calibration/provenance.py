"""Records where a calibration comes from: its recordings, by name and content, and the loads and rates they cover."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from smartshoe.calibration._calibration import Calibration
from smartshoe.signals.loading import rate_range

if TYPE_CHECKING:
    from smartshoe.recording import Recording

RATE_DIGITS = 9
"""Digits of a sampling rate, the reciprocal of a step read from a file: 100 Hz, not 100.00000000000213."""


def without_rounding(rate_hz: float) -> float:
    """A sampling rate rounded to ``RATE_DIGITS``, to remove rounding errors."""
    return float(f"{rate_hz:.{RATE_DIGITS}g}")


def sha256_of(source: str) -> str | None:
    """The SHA-256 of the file ``source`` in hex digits; None where there is no such file."""
    path = Path(source)
    if not source or not path.is_file():
        return None
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def calibrated_on(calibration: Calibration, recordings: Sequence[Recording]) -> Calibration:
    """``calibration`` with its origin filled in from ``recordings`` (at least one, each with a load).

    Sets ``load_range_n`` and ``rate_range_n_per_s`` (least and largest load in N, slowest and fastest loading in N/s),
    ``sample_rate_hz`` (that of the first recording) and ``sources``.
    """
    loads = [recording.force_n for recording in recordings]
    sources = [recording.source or recording.name for recording in recordings]
    return replace(
        calibration,
        load_range_n=(min(float(load.min()) for load in loads), max(float(load.max()) for load in loads)),
        rate_range_n_per_s=rate_range((one.time_s, load) for one, load in zip(recordings, loads, strict=True)),
        sample_rate_hz=without_rounding(recordings[0].sample_rate_hz),
        sources=tuple({"name": source, "sha256": sha256_of(source)} for source in sources),
    )
