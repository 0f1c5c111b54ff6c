"""The keys of a study's file, with errors that name the file, the line and the key."""

from __future__ import annotations

import datetime
from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field, PositiveFloat, ValidationError

from smartshoe.errors import ScenarioError
from smartshoe.runs.scenario import ScenarioText, read_tables


class TrialEntry(BaseModel):
    """``[[trial]]``: a recording of a subject under a condition.

    ``reference`` is a file with the forces of the same trial from a reference instrument (pressure plates, an
    instrumented treadmill); ``date`` selects the calibrations of that day if they come from a store.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)
    file: str = Field(min_length=1)
    subject: str = Field(min_length=1)
    condition: str = Field(min_length=1)
    body_weight_n: PositiveFloat | None = None
    coverage: float = Field(default=1.0, gt=0.0, le=1.0)
    reference: str | None = None
    date: datetime.date | None = None


class StudyPlan(BaseModel):
    """A study's file. Paths are relative to its folder; ``norms`` is a table of ranges with their sources."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    title: str = "Study"
    about: str = ""
    calibrations: str | None = None
    norms: str | None = None
    trial: tuple[TrialEntry, ...] = Field(min_length=1)

    @property
    def conditions(self) -> list[str]:
        """The conditions in the order in which they first appear."""
        return list(dict.fromkeys(entry.condition for entry in self.trial))


def read_study(path: Path | str) -> tuple[StudyPlan, ScenarioText]:
    """Read and check a study's file; raises `ScenarioError`, which says what is wrong, with line and key."""
    tables, source = read_tables(path)
    try:
        plan = StudyPlan.model_validate(tables)
    except ValidationError as error:
        raise source.from_validation(error) from error
    if plan.calibrations is not None and not (source.path.parent / plan.calibrations).exists():
        raise source.error(("calibrations",), f"{plan.calibrations} does not exist: give a folder of calibrations")
    if plan.norms is not None and not (source.path.parent / plan.norms).is_file():
        raise source.error(("norms",), f"{plan.norms} does not exist: give a table of norms")
    seen: dict[str, int] = {}
    for index, entry in enumerate(plan.trial):
        if entry.file in seen:
            raise _twice(source, index, entry.file)
        seen[entry.file] = index
    return plan, source


def _twice(source: ScenarioText, index: int, file: str) -> ScenarioError:
    return source.error(("trial", index, "file"), f"{file} is there twice, which would count it twice: remove one")
