"""`validate`: errors of a calibration on recordings, for the raw, the statically scaled and the compensated force."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.calibration import Calibration, compensate
from smartshoe.calibration._calibration import calibration_from, sensor_for
from smartshoe.calibration.validation import _metrics as metrics
from smartshoe.display import Summarised, SummaryTable, panels, significant
from smartshoe.errors import InputError
from smartshoe.files.logs.accepted import RecordingLike, recordings_of
from smartshoe.kernels.blas import on_one_thread
from smartshoe.signals.loading import Cycle, by_rate, cycles

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FEWEST_SAMPLES = 3  # a line fits any two exactly


@dataclass(frozen=True, eq=False)
class ForceTrace:
    """One recording's signals in N (n,); ``valid`` marks samples that were logged.

    Reference load, raw force (reading on the calibration's scale), best static line, and compensated force.
    """

    name: str
    time_s: Array
    load_n: Array
    raw_n: Array
    static_n: Array
    compensated_n: Array
    valid: Mask


@dataclass(frozen=True, slots=True)
class RateResult:
    """Errors over the cycles of one loading rate (``rate_n_per_s`` None: over everything).

    ``improvement_percent`` is the paper's P%, which mixes the gain with the dynamics;
    ``improvement_over_static_percent`` compares with the best static gain and offset. Hysteresis is the largest
    loading-unloading difference, and the loop area over full scale squared, both in percent of the load's full scale.
    """

    rate_n_per_s: float | None
    cycles: int
    rmse_raw_n: float
    rmse_static_n: float
    rmse_compensated_n: float
    improvement_percent: float | None
    improvement_over_static_percent: float | None
    hysteresis_raw_percent: float | None
    hysteresis_compensated_percent: float | None
    loop_area_raw_percent: float | None
    loop_area_compensated_percent: float | None
    peak_error_n: float
    delay_raw_s: float | None
    delay_s: float | None


@dataclass(frozen=True, eq=False, repr=False)
class Validation(Summarised):
    """How good a calibration is: ``overall``, ``rates`` in ascending order, and the signals behind them."""

    unit: str | None
    overall: RateResult
    rates: tuple[RateResult, ...]
    traces: tuple[ForceTrace, ...]
    full_scale_n: float
    static_gain: float
    static_offset_n: float
    reading_unit: str

    def to_dict(self) -> dict[str, Any]:
        """The validation as a JSON object, schema ``smartshoe.validation/1``."""
        return {
            "schema": "smartshoe.validation/1",
            "unit": self.unit,
            "overall": asdict(self.overall),
            "rates": [asdict(rate) for rate in self.rates],
            "full_scale_n": self.full_scale_n,
            "static": {"gain": self.static_gain, "unit": f"N/{self.reading_unit}", "offset_n": self.static_offset_n},
            "recordings": [{"name": t.name, "samples": int(t.time_s.size)} for t in self.traces],
        }

    def plot(self) -> Figure:
        """A figure with, for each recording, the force with and without compensation over the reference load."""
        figure, axes = panels(len(self.traces))
        for axis, trace in zip(axes, self.traces, strict=True):
            load_n = np.where(trace.valid, trace.load_n, np.nan)
            axis.plot(load_n, trace.static_n, color="0.6", linewidth=0.8, label="best static line")
            axis.plot(load_n, trace.compensated_n, linewidth=0.8, label="compensated")
            ends = [float(np.nanmin(load_n)), float(np.nanmax(load_n))] if trace.valid.any() else [0.0, 0.0]
            axis.plot(ends, ends, color="black", linewidth=0.6, linestyle="--", label="reference")
            axis.set(title=trace.name, xlabel="reference load (N)", ylabel="force (N)")
            axis.legend(loc="upper left")
        return figure

    def _summary_table(self) -> SummaryTable:
        def cells(name: str, one: RateResult) -> list[str]:
            figures = (
                one.rmse_raw_n,
                one.rmse_static_n,
                one.rmse_compensated_n,
                one.improvement_over_static_percent,
                one.hysteresis_compensated_percent,
            )
            return [name, str(one.cycles), *map(significant, figures)]

        rates = [cells(f"{significant(one.rate_n_per_s)} N/s", one) for one in self.rates]
        overall = self.overall
        return SummaryTable(
            f"{self.unit or 'unit'}: RMSE {significant(overall.rmse_compensated_n)} N compensated,"
            f" {significant(overall.rmse_static_n)} N best static line, full scale {significant(self.full_scale_n)} N",
            ["rate", "cycles", "raw N", "static N", "compensated N", "better than static %", "hysteresis %"],
            [cells("all", overall), *rates],
        )


@on_one_thread
def validate(
    recordings: RecordingLike | Sequence[RecordingLike], calibration: Calibration | str | os.PathLike[str]
) -> Validation:
    """Judge a calibration on recordings that have a reference load and a reading of the unit, one or a whole shoe's.

    Parameters
    ----------
    recordings
        One or several: recordings, paths or DataFrames.
    calibration
        The unit's, or the path of its file.

    Returns
    -------
    Validation
        Errors of the raw reading, after the best static line, and compensated, in N, over all and by loading rate. The
        best static gain and offset is one pair fitted on these very recordings: the calibration has to beat a line
        that was allowed to see the data.

    Raises
    ------
    InputError
        For recordings that cannot be judged (`MissingChannelError`, `UnitError`).
    """
    given, calibration = recordings_of(recordings), calibration_from(calibration)
    if not given:
        raise InputError("there is no recording to validate on: give one at least")
    unit = calibration.reading_unit
    sensors = [sensor_for(recording, calibration) for recording in given]
    readings = [sensor.in_unit(unit) for sensor in sensors]
    loads = [recording.force_n for recording in given]
    valid = [sensor.present & recording.load.present for sensor, recording in zip(sensors, given, strict=True)]
    if not any(mask.any() for mask in valid):
        raise InputError(f"{given[0].label}: load and reading are never there together")
    _require_movement(given[0].label, readings, loads, valid)
    gain, offset_n = metrics.best_static(
        np.concatenate([r[m] for r, m in zip(readings, valid, strict=True)]),
        np.concatenate([f[m] for f, m in zip(loads, valid, strict=True)]),
    )
    traces = tuple(
        ForceTrace(
            recording.name,
            recording.time_s,
            load_n,
            calibration.scale * reading,
            gain * reading + offset_n,
            compensate(recording, calibration),
            mask,
        )
        for recording, reading, load_n, mask in zip(given, readings, loads, valid, strict=True)
    )
    full_scale_n = float(np.ptp(np.concatenate([t.load_n[t.valid] for t in traces]))) or 1.0
    found: list[tuple[ForceTrace, Cycle]] = [(t, cycle) for t in traces for cycle in cycles(t.time_s, t.load_n)]
    owner = {id(cycle): trace for trace, cycle in found}
    groups = by_rate([cycle for _, cycle in found])
    rates = tuple(
        _judge(rate, [(owner[id(cycle)], cycle) for cycle in group], full_scale_n) for rate, group in groups.items()
    )
    return Validation(
        calibration.unit or given[0].unit,
        _judge(None, found, full_scale_n, whole=traces),
        rates,
        traces,
        full_scale_n,
        gain,
        offset_n,
        unit.symbol,
    )


def _require_movement(label: str, readings: list[Array], loads: list[Array], valid: list[Mask]) -> None:
    """Raise `InputError` where reading or load is constant, or there are too few samples for a line."""
    for signals, what, mend in (
        (readings, "reading", "check that the unit is connected and that this is its column"),
        (loads, "load", "give a recording in which it rises and falls"),
    ):
        if all(np.ptp(signal[m]) == 0.0 for signal, m in zip(signals, valid, strict=True) if m.any()):
            raise InputError(f"{label}: the {what} never moves, so that nothing can be judged by it: {mend}")
    if (count := sum(int(m.sum()) for m in valid)) < FEWEST_SAMPLES:
        raise InputError(
            f"{label} holds {count} samples with both load and reading, through which a line goes without an error:"
            " record more"
        )


def _mean(values: list[float]) -> float | None:
    return float(np.mean(values)) if values else None


def _judge(
    rate: float | None, found: list[tuple[ForceTrace, Cycle]], full_scale_n: float, whole: tuple[ForceTrace, ...] = ()
) -> RateResult:
    """Errors over ``whole`` records where given, else over the given cycles.

    The figures of loops are over the cycles in either case.
    """
    spans = [(t, slice(None)) for t in whole] or [(t, slice(c.start, c.stop)) for t, c in found]

    def errors(name: str) -> Array:
        return np.concatenate([(getattr(t, name) - t.load_n)[span][t.valid[span]] for t, span in spans])

    def delays(name: str) -> float | None:
        each = [
            metrics.delay_s(t.load_n[s], getattr(t, name)[s], float(np.median(np.diff(t.time_s))))
            for t, s in spans
            if t.load_n[s].size > 2
        ]
        return _mean([value for value in each if value is not None])

    def widths(name: str) -> float | None:
        each = []
        for t, c in found:
            up, down = slice(c.up.start, c.up.stop), slice(c.down.start, c.down.stop)
            signal = getattr(t, name)
            each.append(metrics.loop_width(t.load_n[up], signal[up], t.load_n[down], signal[down]))
        mean = _mean([value for value in each if value is not None])
        return None if mean is None else 100.0 * mean / full_scale_n

    def areas(name: str) -> float | None:
        each = [
            metrics.loop_area(t.load_n[c.start : c.stop], getattr(t, name)[c.start : c.stop]) / full_scale_n**2
            for t, c in found
        ]
        mean = _mean(each)
        return None if mean is None else 100.0 * mean

    raw, static, compensated = (metrics.rmse(errors(name)) for name in ("raw_n", "static_n", "compensated_n"))
    return RateResult(
        rate,
        len(found),
        raw,
        static,
        compensated,
        metrics.improvement_percent(raw, compensated),
        metrics.improvement_percent(static, compensated),
        widths("static_n"),
        widths("compensated_n"),
        areas("static_n"),
        areas("compensated_n"),
        float(np.max(np.abs(errors("compensated_n")))),
        delays("static_n"),
        delays("compensated_n"),
    )
