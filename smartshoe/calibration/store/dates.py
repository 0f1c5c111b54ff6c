"""Dates of calibrations and events: read from ISO 8601, stored as UTC moments, written in the shortest exact form."""

from __future__ import annotations

from datetime import UTC, date, datetime, time

from smartshoe.errors import UsageError
from smartshoe.units import DAY_S


def moment(given: str | date | datetime, what: str = "the date") -> datetime:
    """``given`` as a moment in UTC; a date alone means midnight, a time without a zone is taken as UTC.

    Raises `UsageError` naming ``what`` where it is not an ISO date.
    """
    if isinstance(given, str):
        try:
            given = datetime.fromisoformat(given.strip())
        except ValueError as error:
            raise UsageError(
                f"{what} is {given!r}: write it as 2026-03-31 or 2026-03-31T14:30 (UTC unless it says otherwise)"
            ) from error
    if not isinstance(given, datetime):
        given = datetime.combine(given, time())
    return given.replace(tzinfo=UTC) if given.tzinfo is None else given.astimezone(UTC)


def iso(at: datetime) -> str:
    """The moment as text: only the date at midnight, else with the time, omitting trailing zero parts."""
    if at.time() == time():
        return at.date().isoformat()
    precision = "minutes" if not (at.second or at.microsecond) else "seconds" if not at.microsecond else "microseconds"
    return at.replace(tzinfo=None).isoformat(timespec=precision) + "Z"


def days_between(start: datetime, end: datetime) -> float:
    """Days from ``start`` to ``end``, negative where ``end`` is earlier."""
    return (end - start).total_seconds() / DAY_S
