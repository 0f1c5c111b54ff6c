"""Studies: trials of many subjects under several conditions, compared within subjects."""

from smartshoe.runs.studies._running import StudyResult, study

__all__ = ["StudyResult", "study"]
