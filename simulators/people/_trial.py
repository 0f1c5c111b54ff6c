"""A trial: a person moves in two shoes; the true loads and events, and what the units recorded."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from simulators.people._plates import Measured
from simulators.people.events import TrueEvent, events_of
from simulators.people.person import Activity, Part, Person, Walk
from simulators.people.plan import FEET, GaitPlan, plan
from simulators.people.shape import COVERAGE, Outside
from smartshoe.arrays import Array
from smartshoe.errors import UsageError
from smartshoe.recording import REGIONS, Recording

SAMPLE_RATE_HZ = 200.0  # Chinimilli 2016, Section II
BLOCK_S = 300.0
ADC_BITS = 12


@dataclass(frozen=True, eq=False)
class Trial:
    """A trial, or a block of a long one.

    ``time_s`` (n,); ``total_n`` maps "left" and "right" to the foot's true vertical force (n,) in N, including the part
    beside the coils; ``unit_n`` maps "left_toe", ... to the true load (n,) on that unit; ``events`` are the true ones,
    in order; ``recording`` is what was recorded: in mbar through bladder, sensor and converter, or in N.
    """

    person: Person
    coverage: float
    time_s: Array
    total_n: Mapping[str, Array]
    unit_n: Mapping[str, Array]
    events: tuple[TrueEvent, ...]
    recording: Recording

    def times_s(self, foot: str, event: str) -> Array:
        """Times (m,) of one foot's events of one kind."""
        return np.array([e.time_s for e in self.events if e.foot == foot and e.event == event])


def trial(
    person: Person | None = None,
    activity: Activity | Sequence[Part] | Measured | None = None,
    duration_s: float | None = 60.0,
    rng: np.random.Generator | None = None,
    **settings: Any,
) -> Trial:
    """A whole trial: the `blocks` with the same settings joined."""
    return next(iter(blocks(person, activity, duration_s, rng, block_s=np.inf, **settings)))


def blocks(  # noqa: PLR0913 - a public verb
    person: Person | None = None,
    activity: Activity | Sequence[Part] | Measured | None = None,
    duration_s: float | None = 60.0,
    rng: np.random.Generator | None = None,
    *,
    sample_rate_hz: float = SAMPLE_RATE_HZ,
    sensors: bool = True,
    sides: Sequence[str] = FEET,
    coverage: float = COVERAGE,
    outside: Outside = "midfoot",
    first_contact_s: float = 0.5,
    noise_n: float = 0.0,
    drift: float = 0.0,
    units: Mapping[str, Mapping[str, Any]] | None = None,
    block_s: float = BLOCK_S,
    name: str = "trial",
) -> Iterator[Trial]:
    """A trial block by block, in memory that does not grow with the samples.

    Parameters
    ----------
    activity: `Walk` (the default), `Run`, `Stand`, `Tiptoe`, or a sequence of (activity, seconds). With
        ``duration_s`` None a sequence lasts as long as its parts; else the last part goes on until then. Or what
        plates `measured`, which brings its own person, duration and coverage.
    sensors: through bladder, HDI sensor and converter, in mbar; False records the true loads in N.
    coverage: share of the impulse that passes through the coils; ``outside`` says how the rest is spread over a
        stance: "midfoot" with its own course, "even" the same share at each moment.
    first_contact_s: unloaded until then.
    noise_n: white noise (standard deviation) on loads recorded in N; the sensors have their own.
    drift: what each channel's zero moves over the trial, as a share of body weight (in N) or of the sensor's range.
    units: options of the units (`simulators.people._units.sensing_units`), for example {"*": {"bladder":
        {"hysteresis": {"strength": 0.02}}}}.

    Loads are linear between samples for the bladders. Raises `UsageError` on what cannot be.
    """
    if not sample_rate_hz > 0:
        raise UsageError(f"sample_rate_hz is {sample_rate_hz:g}: give a rate above 0 Hz")
    rng = rng if rng is not None else np.random.default_rng(0)
    plan_rng, unit_rng, noise_rng = rng.spawn(3)
    made: GaitPlan | Measured
    if isinstance(activity, Measured):
        made, coverage = activity, activity.coverage
    else:
        made = plan(
            person or Person(), Walk() if activity is None else activity, duration_s, plan_rng,
            coverage=coverage, outside=outside, first_contact_s=first_contact_s,
        )  # fmt: skip
    count = max(2, round(made.duration_s * sample_rate_hz))
    sampler = None
    if sensors:
        from simulators.people._units import sensing_units
        from simulators.people.sensing import Sampler

        sampler = Sampler(sensing_units(unit_rng, sides, _drifting(units, drift, made.duration_s)), ADC_BITS, unit_rng)
    size = count if np.isinf(block_s) else max(2, round(block_s * sample_rate_hz))
    for start in range(0, count, size):
        # One sample before the block, so that no event is lost between two blocks.
        time_s = np.arange(max(start - 1, 0), min(start + size, count)) / sample_rate_hz
        loads = made.loads_n(time_s)
        events = [
            event
            for foot in sides
            for event in events_of(foot, time_s, loads[:, FEET.index(foot)], made.person.body_weight_n)
        ]
        own = slice(1 if start else 0, None)
        time_s, loads = time_s[own], loads[own]
        unit_n = {
            f"{side}_{region}": np.ascontiguousarray(loads[:, FEET.index(side), column])
            for side in sides
            for column, region in enumerate(REGIONS)
        }
        columns: dict[str, Array]
        if sampler is not None:
            readings, _ = sampler.read(np.column_stack(list(unit_n.values())), sample_rate_hz)
            columns = {f"{unit}_mbar": readings[:, column] for column, unit in enumerate(unit_n)}
        else:
            zero_n = drift * made.person.body_weight_n * time_s / made.duration_s
            columns = {
                f"{unit}_n": load + zero_n + (noise_n * noise_rng.standard_normal(load.size) if noise_n else 0.0)
                for unit, load in unit_n.items()
            }
        metadata = {"body_weight_n": f"{made.person.body_weight_n:g}", "coverage": f"{coverage:g}"}
        yield Trial(
            made.person,
            coverage,
            time_s,
            {side: loads[:, FEET.index(side)].sum(axis=1) for side in sides},
            unit_n,
            tuple(sorted(events, key=lambda event: event.time_s)),
            Recording.from_arrays(time_s=time_s, name=name, unit=None, metadata=metadata, **columns),
        )


def _drifting(
    units: Mapping[str, Mapping[str, Any]] | None, drift: float, duration_s: float
) -> Mapping[str, Mapping[str, Any]]:
    """The units' options with a zero that drifts by ``drift`` of each sensor's range over the trial."""
    given = {unit: {key: dict(table) for key, table in options.items()} for unit, options in (units or {}).items()}
    if drift:
        from simulators.instruments import presets

        for side in FEET:
            for region in REGIONS:
                unit = f"{side}_{region}"
                range_mbar = presets.sensor_range_pa(unit) / 100.0
                sensor = given.setdefault(unit, {}).setdefault("sensor", {})
                sensor.setdefault("zero_drift_mbar_per_s", drift * range_mbar / duration_s)
    return given


__all__ = ["GaitPlan", "Trial", "blocks", "trial"]
