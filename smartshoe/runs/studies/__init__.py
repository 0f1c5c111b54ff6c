"""Studies: many trials by subject and condition, compared within subjects."""

from smartshoe.runs.studies._running import StudyResult, study

__all__ = ["StudyResult", "study"]
