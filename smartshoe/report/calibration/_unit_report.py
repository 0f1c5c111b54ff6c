"""What a calibration's page says of one unit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from smartshoe.calibration.validation import Validation
from smartshoe.recording import Recording


@dataclass(frozen=True, slots=True)
class DiagnosisLink:
    """A diagnosis in a sentence, where its own page lies (relative to this one), and what its extended model leaves.

    ``extended_force_rmse_n`` is judged on data that was not fitted; None where the diagnosis has no such figure.
    """

    says: str
    page: str
    extended_force_rmse_n: float | None = None


@dataclass(frozen=True, eq=False)
class UnitReport:
    """What the page says of one unit; ``identification`` is `Identification.to_dict()`.

    ``files`` are links to what was written or read, by what they are, relative to the page. ``diagnose`` is the
    command that looks into the unit's error, empty where it has been done.
    """

    name: str
    identification: Mapping[str, Any]
    validation: Validation
    recordings: Sequence[Recording]
    fitted: Sequence[str]
    judged: Sequence[str]
    diagnosis: DiagnosisLink | None = None
    files: Sequence[tuple[str, str]] = ()
    diagnose: str = ""
