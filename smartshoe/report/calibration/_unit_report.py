"""The data about one unit from which a calibration's page is made."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from smartshoe.calibration.validation import Validation
from smartshoe.recording import Recording


@dataclass(frozen=True, slots=True)
class DiagnosisLink:
    """A diagnosis as a sentence, the path of its page (relative to this one), and the error of its extended model.

    ``extended_force_rmse_n`` is computed on data that was not fitted; None if the diagnosis has no such figure.
    """

    says: str
    page: str
    extended_force_rmse_n: float | None = None


@dataclass(frozen=True, eq=False)
class UnitReport:
    """One unit of the page; ``identification`` is `Identification.to_dict()`.

    ``files`` are links (label, path relative to the page) to files that were written or read. ``diagnose`` is the
    command that would diagnose the unit, empty if that was done.
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
