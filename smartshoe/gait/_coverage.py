"""Coverage: from the load on the units to the force on the whole foot.

Four sensing coils miss the midfoot. A share alone says how much of the impulse the coils bear, not when. If the share
is taken to be the same at each moment ("even"), the whole force comes out too high while the coils bear much and too
low while the midfoot does. A course over the stance says when: it is either learned from a trial in which force plates
measured the whole force, or computed for the midfoot in walking from published landmarks of regional loads.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from smartshoe.arrays import Array
from smartshoe.errors import InputError, UsageError
from smartshoe.files.atomic import write_text
from smartshoe.files.gate import read_text
from smartshoe.gait._contact import Contacts
from smartshoe.gait._edges import WALKING_STANCE_S  # a runner loads the midfoot otherwise

if TYPE_CHECKING:
    from smartshoe.gait._result import GaitResult


POINTS = 101  # of a stance, from 0 to 100 %
LONGEST_STANCE_S = 2.5  # in a longer stance the person stands, and the share is taken as even
FEWEST_STANCES = 5
# Percent of stance, and load beside the coils in body weights: the published whole force of walking (1.03 at 24 %, 0.68
# at 43 %, 1.11 at 72 %) less what heel (0.70 at 13 %, off at 48 %), meta4 (on at 26 %, 0.49 at 75 %), meta1 (0.21) and
# toe (0.43 at 84 %) bear at that time; half cosines join the landmarks.
MIDFOOT = ((0.0, 0.0), (8.0, 0.0), (24.0, 0.47), (43.0, 0.46), (72.0, 0.05), (80.0, 0.0), (100.0, 0.0))
HEADER = ("stance_percent", "beside_share")


@dataclass(frozen=True)
class Coverage:
    """The ``share`` of a foot's impulse that passes through its units, above 0 and at most 1.

    ``course`` (`POINTS`) is the load beside the units at 0 to 100 % of a stance, divided by the mean load on the units
    in that stance; None means the same share at each moment. Standing and stances shorter than ``least_stance_s``
    always use the same share at each moment.
    """

    share: float = 1.0
    course: tuple[float, ...] | None = None
    least_stance_s: float = 0.0

    def __post_init__(self) -> None:
        if not (math.isfinite(self.share) and 0.0 < self.share <= 1.0):
            raise UsageError(f"coverage is {self.share:g}: give the share of the load on the units, above 0, at most 1")
        if self.course is not None and len(self.course) != POINTS:
            raise UsageError(f"a course of coverage has {len(self.course)} points: give {POINTS}, 0 to 100 % of stance")

    @classmethod
    def midfoot(cls, share: float) -> Coverage:
        """Coverage of ``share`` where the rest of the load is on the midfoot, as in walking at an ordinary speed."""
        percent, beside = np.array(MIDFOOT).T
        at = np.interp(np.arange(POINTS), percent, np.arange(percent.size))
        from_ = np.minimum(at.astype(int), percent.size - 2)
        course = beside[from_] + np.diff(beside)[from_] * (0.5 - 0.5 * np.cos(np.pi * (at - from_)))
        course *= (1.0 / cls(share).share - 1.0) / course.mean()
        return cls(share, tuple(float(value) for value in course), WALKING_STANCE_S)

    @property
    def says(self) -> str:
        """How the share is applied, as text for a person."""
        return "the same at each moment of a stance" if self.course is None else "by a course over the stance"

    def knows_when(self, *, running: bool) -> bool:
        """Whether peaks of whole forces are right: all load is on the units, or a course says when it is not.

        A course for longer stances than a runner's says nothing of running.
        """
        return self.share == 1.0 or (self.course is not None and not (running and self.least_stance_s > 0.0))

    def whole(self, borne: Array, time_s: Array, contacts: Contacts) -> Array:
        """The force (n,) in N on the whole foot, from the force ``borne`` (n,) in N on its units."""
        if self.course is None:
            return borne / self.share
        found = borne / self.share
        course, place = np.array(self.course), np.linspace(0.0, 1.0, POINTS)
        lasts_s = contacts.toe_off_s - contacts.strike_s
        short = lasts_s[lasts_s <= LONGEST_STANCE_S]
        usual_s = float(np.median(short)) if short.size else np.nan
        for strike_s, off_s in zip(contacts.strike_s, contacts.toe_off_s, strict=True):
            # A stance cut off by the record's start or end is taken to last as long as the others, unless it lasted
            # longer.
            if np.isnan(strike_s) and off_s - time_s[0] <= usual_s:
                strike_s = off_s - usual_s
            elif np.isnan(off_s) and time_s[-1] - strike_s <= usual_s:
                off_s = strike_s + usual_s
            if not self.least_stance_s <= off_s - strike_s <= LONGEST_STANCE_S:
                continue
            first, last = np.searchsorted(time_s, [strike_s, off_s])
            own = borne[first:last]
            if own.size:
                stance = (time_s[first:last] - strike_s) / (off_s - strike_s)
                found[first:last] = own + own.mean() * np.interp(stance, place, course)
        return found

    def save(self, path: Path | str) -> None:
        """Write the course as a plain table of `POINTS` rows; the file is written completely or not at all."""
        rows = self.course if self.course is not None else (1.0 / self.share - 1.0,) * POINTS
        lines = [f"# coverage: {self.share!r}", f"# least_stance_s: {self.least_stance_s!r}", ",".join(HEADER)]
        lines += [f"{percent},{value!r}" for percent, value in enumerate(rows)]
        write_text(path, "\n".join(lines) + "\n")

    @classmethod
    def load(cls, path: Path | str) -> Coverage:
        """Read a course that `save` wrote; raises `InputError`, naming the file, if it is not one."""
        lines = read_text(Path(path), "a course of coverage").splitlines()
        said = dict(line[1:].split(":", 1) for line in lines if line.startswith("#") and ":" in line)
        said = {name.strip(): value for name, value in said.items()}
        rows = list(csv.reader(line for line in lines if not line.startswith("#")))
        if not rows or tuple(rows[0]) != HEADER or len(rows) != POINTS + 1 or "coverage" not in said:
            raise InputError(
                f"{path} is no course of coverage: give a '# coverage:' line, the header {','.join(HEADER)} and"
                f" {POINTS} rows"
            )
        try:
            share, least_s = float(said["coverage"]), float(said.get("least_stance_s", 0.0))
            course = tuple(float(row[1]) for row in rows[1:])
        except (ValueError, IndexError) as error:
            raise InputError(f"{path} is no course of coverage ({error}): learn it anew") from error
        if not np.isfinite(course).all():
            raise InputError(f"{path} holds a number that is not finite: learn it anew")
        return cls(share, course, least_s)


def learn_coverage(found: GaitResult, plate_n: Mapping[str, Array]) -> Coverage:
    """Learn the coverage from a trial in which the whole force was measured too.

    ``plate_n`` maps a foot to its vertical force (n,) in N at that foot's times (``found.feet[foot].time_s``), from an
    instrumented treadmill or from force plates; NaN where the foot was on none. Raises `InputError` if fewer than five
    stances are complete.
    """
    place = np.linspace(0.0, 1.0, POINTS)
    courses, borne_s, whole_s = [], 0.0, 0.0
    for foot, plate in plate_n.items():
        course = found.feet[foot]
        load = course.load.sum(axis=1)
        for strike_s, off_s in zip(course.contacts.strike_s, course.contacts.toe_off_s, strict=True):
            if not off_s - strike_s <= LONGEST_STANCE_S:
                continue
            first, last = np.searchsorted(course.time_s, [strike_s, off_s])
            own, whole = load[first:last], plate[first:last]
            if own.size < 4 or not np.isfinite(whole).all() or own.mean() <= 0.0:
                continue
            stance = (course.time_s[first:last] - strike_s) / (off_s - strike_s)
            courses.append(np.interp(place, stance, (whole - own) / own.mean()))
            borne_s += float(own.sum())
            whole_s += float(whole.sum())
    if len(courses) < FEWEST_STANCES:
        raise InputError(
            f"the whole force is known in {len(courses)} stances: a course of coverage needs {FEWEST_STANCES} or more"
        )
    mean = np.mean(courses, axis=0)
    return Coverage(min(borne_s / whole_s, 1.0), tuple(float(value) for value in mean))
