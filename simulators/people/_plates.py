"""Measured vertical forces instead of simulated ones: files of force plates, spread over the regions of two feet.

It reads BMClab's files (Duarte, CC BY 4.0): ``.forces`` (several plates, whose vertical axis is FY), OpenSim's ``.mot``
(``R_`` and ``L_ground_force_vy``), C3D (plates of types 2 and 4) and two columns ``Time[s] GRF[N]`` (both feet on one
plate, half for each).

*Left out:* which region really bore which load, as plates do not tell: regions follow the shares of
`simulators.people.shape`. A plate under both feet is not separated.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from simulators.people._standing import FLAT
from simulators.people.person import Person
from simulators.people.plan import FEET
from simulators.people.shape import COLUMNS, COVERAGE, PHASES, Outside, table
from smartshoe.arrays import Array
from smartshoe.errors import InputError
from smartshoe.recording import REGIONS
from smartshoe.signals.masks import runs_of

LEVEL_N = 10.0  # above this, a plate is loaded
LONGEST_STANCE_S = 1.3  # a longer contact is standing
SHORTEST_STANCE_S = 0.08
RUNS_FROM = 1.6  # body weights: a higher peak means running
REFERENCE_SPEED = {"walk": 1.3, "run": 2.68}  # m/s, at which the regions' shares are taken


@dataclass(frozen=True, eq=False)
class Measured:
    """Feet on plates: ``measured_s`` (n,), ``foot_n`` (n, 2) left and right, ``regions_n`` (n, 2, 5) as in `COLUMNS`.

    It provides loads in the same way as a plan.
    """

    person: Person
    measured_s: Array
    foot_n: Array
    regions_n: Array
    coverage: float

    @property
    def duration_s(self) -> float:
        """Duration of the measurement in s."""
        return float(self.measured_s[-1] - self.measured_s[0])

    def loads_n(self, time_s: Array) -> Array:
        """Loads (n, 2, 5) in N at the times (n,), the first reading at time 0; zero before and after."""
        found = np.zeros((time_s.size, len(FEET), len(COLUMNS)))
        for foot in range(len(FEET)):
            for column in range(len(COLUMNS)):
                found[:, foot, column] = np.interp(
                    time_s, self.measured_s - self.measured_s[0], self.regions_n[:, foot, column], left=0.0, right=0.0
                )
        return found


def measured(
    path: Path | str,
    *,
    coverage: float = COVERAGE,
    outside: Outside = "midfoot",
    first_foot: str = "right",
    body_weight_n: float | None = None,
) -> Measured:
    """The feet in a force-plate file.

    Plates stepped on in turn are assigned to ``first_foot`` and the other alternately. The default of ``body_weight_n``
    is the stances' mean impulse over the mean time between strikes, or the median of what a plate bears for long.
    Raises `InputError` for a file of none of these formats.
    """
    time_s, forces, named = _read(Path(path))
    if named:
        foot_n = forces
    elif forces.shape[1] == 1:
        foot_n = np.repeat(0.5 * forces, 2, axis=1)
    else:
        foot_n = np.zeros((time_s.size, 2))
        met = sorted(
            (first, last, plate)
            for plate in range(forces.shape[1])
            for first, last in _stances(forces[:, plate], time_s)
        )
        for number, (first, last, plate) in enumerate(met):
            foot_n[first:last, (FEET.index(first_foot) + number) % 2] += forces[first:last, plate]
    spans = [_stances(foot_n[:, foot], time_s) for foot in range(2)]
    weight_n = body_weight_n if body_weight_n is not None else _body_weight_n(time_s, foot_n, spans, str(path))
    regions_n = np.zeros((time_s.size, 2, len(COLUMNS)))
    usual_s = _usual_s(time_s, spans)
    for foot, own in enumerate(spans):
        for first, last in own:
            part = slice(first, last)
            begin_s, end_s = float(time_s[first]), float(time_s[last - 1])
            # A contact cut off by the end of the record is given the duration of the others.
            if last == time_s.size:
                end_s = max(end_s, begin_s + usual_s)
            elif first == 0:
                begin_s = min(begin_s, end_s - usual_s)
            share = _shares(time_s[part], (begin_s, end_s), foot_n[part, foot].max() / weight_n, coverage, outside)
            regions_n[part, foot] = foot_n[part, foot, None] * share
    return Measured(Person(weight_n), time_s, foot_n, regions_n, coverage)


def _read(path: Path) -> tuple[Array, Array, bool]:
    """Time (n,), vertical forces (n, plates), and whether the columns are left and right."""
    if path.suffix == ".c3d":
        return *_of_c3d(path), False
    try:
        lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError as error:
        raise InputError(f"{path} cannot be read ({error.strerror}): give the path of a plates' file") from error
    try:
        if path.suffix == ".forces":
            head = next(at for at, line in enumerate(lines) if line.startswith("#"))
            names = lines[head].lstrip("#").split("\t")
            rate_hz = float(next(line for line in lines if line.startswith("SampleRate")).split("=")[1])
            rows = np.loadtxt(lines[head + 1 :])
            vertical = [at for at, name in enumerate(names) if name.startswith("FY")]
            return np.arange(rows.shape[0]) / rate_hz, np.maximum(rows[:, vertical], 0.0), False
        if path.suffix == ".mot":
            head = next(at for at, line in enumerate(lines) if line.split()[:1] == ["time"])
            names = lines[head].split()
            rows = np.loadtxt(lines[head + 1 :])
            both = [names.index(f"{side}_ground_force_vy") for side in ("L", "R")]
            return rows[:, names.index("time")], np.maximum(rows[:, both], 0.0), True
        if lines and lines[0].split("\t") == ["Time[s]", "GRF[N]"]:
            rows = np.loadtxt(lines[1:])
            return rows[:, 0], np.maximum(rows[:, 1:2], 0.0), False
    except (ValueError, StopIteration, IndexError) as error:
        raise InputError(f"{path} is cut off or has other columns than its kind: {error}") from error
    raise InputError(
        f"{path} is no plates' file that is known: give a .forces, a .mot, a .c3d, or columns Time[s] and GRF[N]"
    )


def _of_c3d(path: Path) -> tuple[Array, Array]:
    """Time (n,) and vertical forces (n, plates) of a C3D file's plates of types 2 and 4; needs the extra ``c3d``."""
    try:
        import ezc3d
    except ImportError as error:
        raise InputError(f"{path} needs the package ezc3d: install smartshoe[c3d]") from error
    try:
        file = ezc3d.c3d(str(path))
        platform, analog = file["parameters"]["FORCE_PLATFORM"], file["data"]["analogs"][0]
        rate_hz = float(file["parameters"]["ANALOG"]["RATE"]["value"][0])
        vertical = []
        for plate, kind in enumerate(platform["TYPE"]["value"]):
            channels = analog[np.asarray(platform["CHANNEL"]["value"])[:6, plate].astype(int) - 1]
            if kind == 4:
                channels = np.asarray(platform["CAL_MATRIX"]["value"])[:, :, plate] @ channels
            elif kind != 2:
                raise InputError(f"{path} has a plate of type {kind}: 2 and 4 are read")
            first, last = (int(one) for one in platform["ZERO"]["value"])
            # The force on the plate is opposite to the force of the plate on the person.
            vertical.append(np.median(channels[2, first - 1 : last]) - channels[2])
    except (OSError, RuntimeError, KeyError, IndexError, ValueError) as error:
        raise InputError(f"{path} is no C3D file with force plates: {error}") from error
    force_n = np.stack(vertical, axis=1)
    return np.arange(force_n.shape[0]) / rate_hz, np.maximum(force_n, 0.0)


def _stances(force_n: Array, time_s: Array) -> list[tuple[int, int]]:
    found = []
    for first, last in zip(*runs_of(force_n > LEVEL_N), strict=True):
        # Extended to zero on either side, so that the load does not begin with a step.
        while first > 0 and 0.0 < force_n[first - 1] <= force_n[first]:
            first -= 1
        while last < force_n.size and 0.0 < force_n[last] <= force_n[last - 1]:
            last += 1
        if time_s[last - 1] - time_s[first] >= SHORTEST_STANCE_S:
            found.append((int(first), int(last)))
    return found


def _body_weight_n(time_s: Array, foot_n: Array, spans: list[list[tuple[int, int]]], where: str) -> float:
    every = sorted(span for own in spans for span in own)
    long = [span for span in every if time_s[span[1] - 1] - time_s[span[0]] > LONGEST_STANCE_S]
    if long:
        total = foot_n.sum(axis=1)
        return float(np.median(total[total > LEVEL_N]))
    if len(every) < 2:
        raise InputError(f"{where}: one stance does not tell body weight: give body_weight_n")
    whole = [(a, b) for a, b in every if a > 0 and b < time_s.size]
    gap_s = float(np.mean(np.diff(time_s[[a for a, _ in every]])))
    impulses = [
        float(np.trapezoid(foot_n[a:b, foot], time_s[a:b]))
        for foot, own in enumerate(spans)
        for a, b in own
        if (a, b) in whole
    ]
    return float(np.mean(impulses)) / gap_s


def _usual_s(time_s: Array, spans: list[list[tuple[int, int]]]) -> float:
    whole = [time_s[b - 1] - time_s[a] for own in spans for a, b in own if a > 0 and b < time_s.size]
    return float(np.median(whole)) if whole else 0.0


def _shares(time_s: Array, span_s: tuple[float, float], peak: float, coverage: float, outside: Outside) -> Array:
    """Each column's share (n, 5) of the force of a contact with this span and peak in body weights; the sum is one."""
    lasts_s = span_s[1] - span_s[0]
    if lasts_s > LONGEST_STANCE_S:
        flat = [coverage * FLAT[region] for region in REGIONS]
        return np.tile([*flat, 1.0 - coverage], (time_s.size, 1))
    kind: Literal["walk", "run"] = "run" if peak > RUNS_FROM else "walk"
    shape = table(kind, REFERENCE_SPEED[kind], coverage, outside)
    place = np.clip((time_s - span_s[0]) / lasts_s, 0.002, 0.998) * PHASES
    grid = np.arange(PHASES + 1)
    found = np.column_stack([np.interp(place, grid, shape[:, column]) for column in range(len(COLUMNS))])
    return np.asarray(found / found.sum(axis=1, keepdims=True))
