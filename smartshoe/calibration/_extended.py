"""The extended model inverted: force from readings, undoing hysteresis, curves, lag and drift."""

from __future__ import annotations

import math
from types import MappingProxyType

import numpy as np

from smartshoe.arrays import Array, require_positive
from smartshoe.calibration._core_inverse import CoreInverse
from smartshoe.calibration._filter import ForceFilter
from smartshoe.calibration._noise_limit import MOST, NoiseLimit, noise_gain
from smartshoe.display import significant
from smartshoe.errors import UsageError
from smartshoe.models.effects import Memoryless, refuse_other_size
from smartshoe.models.effects.effect import ChainContext, CStep, Inverse
from smartshoe.models.elements import Arm
from smartshoe.models.extended import ExtendedModel, Part
from smartshoe.units import Unit, declared, find_unit

LEAK_CAUTION = (
    "the air that is gone is summed up from the readings, so that an error of their zero grows with time: reset the"
    " filter at rest"
)
HOUR_S = 3600.0


class ExtendedCompensator(ForceFilter):
    """The inverse of an `ExtendedModel`'s chain at ``sample_rate_hz``: the inverse blocks, in reverse order.

    ``not_inverted`` maps effects that cannot be undone on a stream, and are therefore skipped, to one sentence each.
    ``cautions`` maps effects whose inverse makes demands on the readings to one sentence each. Time, which drifts
    depend on, is counted from the first reading, plus ``started_s``, the seconds for which the unit has already been
    on. The start and the handling of missing readings and streams are those of `ForceFilter`; at the start no leak or
    wear has accumulated. Raises `UsageError` for a rate that is not positive.
    """

    def __init__(
        self,
        model: ExtendedModel,
        sample_rate_hz: float = 100.0,
        *,
        started_s: float = 0.0,
        reading_unit: Unit | None = None,
    ) -> None:
        sample_rate_hz = require_positive(sample_rate_hz, "sample_rate_hz")
        if not (np.isfinite(started_s) and started_s >= 0):
            raise UsageError(f"started_s is {started_s:g}: give the seconds since the unit was switched on, from 0")
        self.model = model
        self.sample_rate_hz = sample_rate_hz
        self.step_s = 1.0 / sample_rate_hz
        self.started_s = float(started_s)
        self.reading_unit = reading_unit or find_unit(model.reading_unit) or declared(model.reading_unit)
        self.reading_per_share = model.full_scale_reading * model.gain
        self.core = CoreInverse(model.core, self.step_s)
        self._blocks: list[tuple[str, Inverse]] = []
        self._passed_over: dict[str, str] = {}
        self._noise = model.noise / model.gain  # of the signal, as far as it has been undone
        leaks = (part for part in model.parts if part.effect.is_leak)
        self._moved: dict[str, float] = {}
        self._left_s: dict[str, float] = {}
        self._cautions = {part.name: LEAK_CAUTION for part in leaks if not part.effect.is_null(part.values)}
        for part in reversed(model.chain):
            if part is None:
                self._undo_core()
            elif not (part.effect.parameters and part.effect.is_null(part.values)):
                self._undo(part)
        self.blocks = tuple(self._blocks)
        self.not_inverted = MappingProxyType(self._passed_over)
        self.cautions = MappingProxyType(self._cautions)
        self.moved_by_the_clock = MappingProxyType(self._moved)
        self.lags_left_s = MappingProxyType(self._left_s)
        self.reset()

    def _undo(self, part: Part) -> None:
        # Noise is never subtracted: even a tone's phase belongs to the session it was fitted on.
        arm = Arm(self.model.relaxing_share, self.model.relaxation_rate_per_s)
        chain = ChainContext(arm, self._noise)
        inverse = part.effect.inverse_within(chain, part.values, self.step_s) if part.effect.is_physical else None
        if inverse is None:
            self._passed_over[part.name] = _why_not(part)
            return
        if isinstance(inverse, Memoryless) and math.isfinite(part.until_s):
            inverse = inverse.until(part.until_s)
        self._blocks.append((part.name, inverse))
        moved = _moved_by_the_clock(inverse, self.started_s, part.until_s)
        if moved:
            self._moved[part.name] = moved
            self._cautions[part.name] = _going_on(part, moved)
        if not part.effect.is_latency:
            return
        raised = noise_gain(inverse)
        self._noise *= min(raised, MOST)
        if raised <= MOST:
            self._cautions[part.name] = f"undoing it raises fast noise of the readings {raised:.3g} times"
            return
        limit = NoiseLimit(MOST / raised)
        self._left_s[part.name] = left_s = limit.lag_steps * self.step_s
        self._blocks.append((f"{part.name}_limit", limit))
        self._cautions[part.name] = (
            f"undoing it would raise fast noise of the readings {raised:.3g} times: smoothed to {MOST:g} times, which"
            f" leaves a lag of {1e3 * left_s:.3g} ms"
        )

    def _undo_core(self) -> None:
        self._blocks.append(("core", self.core))
        self._noise *= 1.0 + max(self.model.relaxing_share, 0.0)  # a sudden load reads less than a held one by this
        if not self.core.is_exact:
            self._cautions["baseline"] = (
                f"{self.sample_rate_hz:g} Hz is coarse for this relaxation: the bilinear transform stands in for the"
                " exact inverse, which would ring"
            )

    def reset(self) -> None:
        """Return to the initial state: start in the steady state of the next reading, with time at its beginning."""
        super().reset()
        for _, inverse in self.blocks:
            inverse.reset()

    def _copy(self) -> ExtendedCompensator:
        return ExtendedCompensator(
            self.model, self.sample_rate_hz, started_s=self.started_s, reading_unit=self.reading_unit
        )

    def _begin(self, first: float) -> None:
        """Initialise each block with the first value that reaches it."""

    def _advance(self, readings: Array, count: int) -> Array:
        time_s: Array = self.started_s + np.arange(count, count + readings.size, dtype=float) * self.step_s
        signal = readings / self.reading_per_share
        # Far beyond full scale no load may give the reading through a curve; the curve is skipped there.
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            for name, inverse in self.blocks:
                undone = inverse.push(signal, time_s)
                refuse_other_size(name, undone, signal.size)
                finite = np.isfinite(undone)
                signal = undone if finite.all() else np.where(finite, undone, signal)
        return np.asarray(self.model.full_scale_load_n * signal)

    def c_steps(self, *, single: bool = False) -> tuple[tuple[str, CStep], ...]:
        """Name and C99 code of every block, in the order in which they run, between the two scalings.

        ``single`` asks for the form that loses least in single precision, still written in doubles.
        """
        return tuple(
            (name, inverse.c_single(name) if single else inverse.c_step(name)) for name, inverse in self.blocks
        )


def _moved_by_the_clock(inverse: Inverse, started_s: float, until_s: float) -> float:
    """The change of a full-scale signal within an hour (share of full scale) from an inverse that depends only on time.

    If the drift is held from ``until_s`` on, the change until then. 0 for an inverse that depends on the readings.
    """
    if not isinstance(inverse, Memoryless):
        return 0.0
    ends_s = until_s if math.isfinite(until_s) else started_s + HOUR_S
    first, last = inverse.push(np.ones(2), np.array([started_s, ends_s])).tolist()
    return float(last - first)


def _going_on(part: Part, moved: float) -> str:
    """The caution about a drift for the filter's user; ``moved`` as returned by `_moved_by_the_clock`."""
    by = f"moves a full-scale force by {significant(100.0 * moved, 2)} %"
    if math.isfinite(part.until_s):
        return (
            f"it goes with the clock from the first reading on until {part.until_s:.4g} s, the end of what it was"
            f" fitted to, and is held from then on, where it {by}; reset the filter where a session begins"
        )
    return (
        "it goes on with the clock from the first reading on, however short the recordings were that it was fitted to:"
        f" an hour later it {by}; reset the filter where a session begins"
    )


def _why_not(part: Part) -> str:
    effect = part.effect
    if not effect.is_physical:
        return "noise and faults of the data cannot be taken off a single reading"
    strengths = (parameter for parameter in effect.parameters if parameter.null is not None)
    channels = sorted({*effect.needs, *(one.channel for one in strengths if one.channel)})
    if channels:
        return f"it follows another channel ({', '.join(channels)}), which one unit's readings do not carry"
    return effect.why_not_undone or "it has no inverse that runs on a stream of readings"
