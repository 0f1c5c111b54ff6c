"""What a report is made of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from smartshoe.recording import Recording
    from smartshoe.validate import Validation


@dataclass(frozen=True, eq=False)
class UnitReport:
    """One unit: identification (smartshoe.identification/1), validation, recordings, filter and remarks.

    ``compensator_info`` holds a1, b0, b1, rate (Hz), numerator and denominator (in z^-1).
    """

    name: str
    identification_dict: Mapping[str, Any]
    validation: Validation
    recordings: Sequence[Recording]
    compensator_info: Mapping[str, Any]
    notes: Sequence[str] = ()


@dataclass(frozen=True, eq=False)
class Report:
    """A page: ``tables`` are (caption, header, rows) of text; ``seeds`` and ``versions`` name to value."""

    title: str
    intro: str = ""
    units: Sequence[UnitReport] = ()
    tables: Sequence[tuple[str, Sequence[str], Sequence[Sequence[str]]]] = ()
    seeds: Mapping[str, Any] = field(default_factory=dict)
    versions: Mapping[str, str] = field(default_factory=dict)
