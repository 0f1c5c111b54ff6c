"""`Identification`: the identified model of a unit, with its uncertainty."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from smartshoe.arrays import Array
from smartshoe.calibration import Calibration, Compensator
from smartshoe.calibration.provenance import sha256_of
from smartshoe.display import Summarised, SummaryTable, panels, significant
from smartshoe.errors import RefusedError, UsageError
from smartshoe.files.logs.accepted import RecordingLike, recording_of
from smartshoe.identification._consistency import ConsistencyTest, consistency_test
from smartshoe.identification._estimator import ParameterFit
from smartshoe.identification._experiment import Direction
from smartshoe.identification._residual_tests import ResidualTest, residual_tests
from smartshoe.kernels.blas import on_one_thread
from smartshoe.models import Parameter, StandardLinearSolid, discretise
from smartshoe.models.parameter import finite_or_none
from smartshoe.units import Unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SCHEMA = "smartshoe.identification/1"


@dataclass(frozen=True, eq=False, repr=False)
class Identification(Summarised):
    """force / reading = (b0 s + b1)/(s + a1), Chinimilli 2016 (13), with its uncertainty.

    ``parameters`` are a1, b0, b1 (readings in ``reading_unit``) and k1, k2, c, whatever the ``direction`` (which
    signal's error was minimised) and the ``estimator`` (which noise was allowed for); ``covariance`` (6, 6) is in their
    order. By recording, ``offsets`` are the readings at no load, ``load_offsets`` the load cell's zero (one of the two
    is fixed), ``initial_states`` the coefficients of the decaying initial transient. ``delay_s`` is positive where the
    reading is later than the load. ``noise`` is the white noise of load and reading, ``scale`` N per reading unit of
    the paper's force. ``rmse`` is in N (inverse) or reading units (forward).
    """

    unit: str
    direction: Direction
    method: str
    structure: str
    estimator: str
    parameters: Mapping[str, Parameter]
    covariance: Array
    offsets: Mapping[str, Parameter]
    load_offsets: Mapping[str, Parameter]
    delay_s: Parameter
    initial_states: Mapping[str, Parameter]
    noise: Mapping[str, Parameter]
    fit_percent: float
    rmse: float
    rmse_unit: str
    iterations: int
    converged: bool
    sample_rate_hz: float
    reading_unit: Unit
    scale: float
    n_samples: int
    n_missing: int
    load_range_n: tuple[float, float]
    rate_range_n_per_s: tuple[float, float]
    sources: tuple[str, ...]
    remarks: tuple[str, ...]
    fit: ParameterFit

    # -- errors ----------------------------------------------------------------------------------------------
    @cached_property
    def errors(self) -> Mapping[str, Array]:
        """By recording, model minus measured (n,) at every sample, including those that were not counted."""
        problem = self.fit.problem
        return {
            experiment.name: experiment.of_recording(problem.model_error(self.fit.theta, index))
            for index, experiment in enumerate(problem.experiments)
        }

    def predicted(self, recording: RecordingLike) -> Array:
        """The model's output for a recording of this fit.

        Parameters
        ----------
        recording
            Its name, or the recording itself: as a `Recording`, a path or a DataFrame.

        Returns
        -------
        (n,) the reading in ``reading_unit`` (forward) or the load in N (inverse) at every sample, with the offsets,
        the delay and the initial state as fitted.

        Raises
        ------
        UsageError
            Where the fit did not use this recording, or ``recording`` is not one.
        """
        name = self._name_of(recording)
        return self._measured[name][1] + self.errors[name]

    def _name_of(self, recording: RecordingLike) -> str:
        """This fit's name for a recording, found by comparing samples, since several may have the same name."""
        if isinstance(recording, str) and recording in self.errors:
            return recording
        fitted = f"use one of {', '.join(self.errors)}"
        if isinstance(recording, str) and not Path(recording).is_file():
            raise UsageError(f"recording {recording!r} is not of this fit: {fitted}")
        given = recording_of(recording)
        for experiment in self.fit.problem.experiments:
            if experiment.is_of(given, self.reading_unit):
                return experiment.name
        raise UsageError(f"recording {given.name!r} is not of this fit, in which none has its samples: {fitted}")

    @cached_property
    def _measured(self) -> Mapping[str, tuple[Array, Array]]:
        """By recording, times (n,) from its start and the output less fixed zeros.

        Errors are the model minus this output.
        """
        settings = self.fit.problem.settings
        inverse = settings.direction == "inverse"
        zero = (settings.load_offset_n if inverse else settings.offset) or 0.0
        return {
            experiment.name: (
                experiment.of_recording(experiment.time_s),
                experiment.of_recording(output) + zero,
            )
            for experiment, output in zip(self.fit.problem.experiments, self.fit.problem.outputs, strict=True)
        }

    def plot(self) -> Figure:
        """A figure: for each recording, the measured signal and the model's, and below them measured minus model."""
        figure, axes = panels(2 * len(self._measured), height=2.0)
        quantity = "load" if self.direction == "inverse" else "reading"
        for upper, lower, (name, (time_s, measured)) in zip(axes[::2], axes[1::2], self._measured.items(), strict=True):
            upper.plot(time_s, measured, color="0.6", label="measured")
            upper.plot(time_s, self.predicted(name), linewidth=1.0, label="model")
            upper.set(title=name, ylabel=f"{quantity} ({self.rmse_unit})")
            upper.legend(loc="upper right")
            lower.plot(time_s, self.residuals[name], linewidth=0.8)
            lower.set(xlabel="time (s)", ylabel=f"residual ({self.rmse_unit})")
        return figure

    def _summary_table(self) -> SummaryTable:
        shown = {
            **self.parameters,
            "delay": self.delay_s,
            **{f"offset ({name})": one for name, one in self.offsets.items()},
        }
        rows = [
            [
                name,
                significant(one.value, 6),
                significant(one.sd, 2),
                *(significant(end, 6) for end in one.ci95),
                one.unit,
            ]
            for name, one in shown.items()
        ]
        return SummaryTable(
            f"{self.unit}: {self.direction} fit by {self.method}, {self.estimator.replace('_', ' ')},"
            f" fit {self.fit_percent:.2f} %, RMSE {significant(self.rmse)} {self.rmse_unit}",
            ["parameter", "value", "sd", "95 % from", "to", "unit"],
            rows,
            self.notes,
        )

    @property
    def residuals(self) -> Mapping[str, Array]:
        """By recording, measured minus model (n,), NaN where a sample was not counted."""
        problem = self.fit.problem
        return {
            experiment.name: np.where(experiment.of_recording(mask), -self.errors[experiment.name], np.nan)
            for experiment, mask in zip(problem.experiments, problem.masks, strict=True)
        }

    @cached_property
    def fit_percent_by_recording(self) -> Mapping[str, float]:
        """``fit_percent`` of each recording alone."""
        problem = self.fit.problem
        return {
            experiment.name: fit_percent(y[mask], problem.model_error(self.fit.theta, index)[mask])
            for index, (experiment, y, mask) in enumerate(
                zip(problem.experiments, problem.outputs, problem.masks, strict=True)
            )
        }

    @cached_property
    def residual_tests(self) -> Mapping[str, ResidualTest]:
        """Tests of the residual by name: whiteness, and independence of the input."""
        problem = self.fit.problem
        errors = [problem.model_error(self.fit.theta, index) for index in range(len(problem.experiments))]
        return residual_tests(problem, self.fit.theta, errors)

    @cached_property
    def consistency(self) -> ConsistencyTest:
        """Test of the paper's two-parameter form (c = 1) against the three coefficients (free structure only)."""
        if self.structure != "free":
            raise RefusedError("a grey box holds c by itself: ask for the consistency of a free fit")
        return consistency_test(self.coefficients, self.covariance[:3, :3], scale=self.scale)

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks about this result for the user, one sentence each."""
        if self.residual_tests["whiteness"].p_value < 0.01:
            return (
                *self.remarks,
                "the residual is not white: the error bars hold for white noise only and are too small here",
            )
        return self.remarks

    @property
    def coefficients(self) -> tuple[float, float, float]:
        """a1 in 1/s, b0 in N per reading unit, b1 in N per reading unit and s."""
        return self.parameters["a1"].value, self.parameters["b0"].value, self.parameters["b1"].value

    @property
    def solid(self) -> StandardLinearSolid:
        """The standard linear solid with the parameters k1, k2, c."""
        return StandardLinearSolid(*(self.parameters[name].value for name in ("k1", "k2", "c")))

    @property
    def correlation(self) -> Array:
        """(6, 6) correlations in the order of ``parameters``; 0 for a fixed parameter."""
        sd = np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        safe = np.where(sd > 0, sd, 1.0)
        matrix: Array = np.clip(self.covariance / np.outer(safe, safe), -1.0, 1.0)
        np.fill_diagonal(matrix, 1.0)
        return matrix

    @property
    def offset(self) -> float:
        """The reading at no load, the mean over recordings, in ``reading_unit``."""
        return float(np.mean([parameter.value for parameter in self.offsets.values()]))

    def discrete(self, sample_rate_hz: float | None = None) -> tuple[Array, Array]:
        """Numerator and denominator of the bilinear filter, by default at the sampling rate of the data."""
        return discretise(
            *self.coefficients, self.sample_rate_hz if sample_rate_hz is None else sample_rate_hz, "bilinear"
        )

    def compensator(self, sample_rate_hz: float = 100.0) -> Compensator:
        """The filter that turns readings (in ``reading_unit``) into force in N."""
        a1, b0, b1 = self.coefficients
        return Compensator(
            a1, b0, b1, offset=self.offset, sample_rate_hz=sample_rate_hz, reading_unit=self.reading_unit
        )

    def calibration(self, created: str = "", *, unit: str | None = None) -> Calibration:
        """The calibration of ``unit``, ready to be saved; by default of the unit named in the recordings.

        ``created`` is an ISO date for the file, if wanted.
        """
        from smartshoe.version import __version__

        a1, b0, b1 = self.coefficients
        return Calibration(
            a1=a1,
            b0=b0,
            b1=b1,
            reading_unit=self.reading_unit,
            offset=self.offset,
            unit=self.unit if unit is None else unit,
            parameters=dict(self.parameters),
            covariance=tuple(tuple(float(value) for value in row) for row in self.covariance),
            scale=self.scale,
            delay_s=self.delay_s.value,
            load_range_n=self.load_range_n,
            rate_range_n_per_s=self.rate_range_n_per_s,
            sample_rate_hz=self.sample_rate_hz,
            sources=tuple({"name": source, "sha256": sha256_of(source)} for source in self.sources),
            created=created,
            smartshoe_version=__version__,
        )

    def to_dict(self) -> dict[str, Any]:
        """The identification as a JSON object, schema smartshoe.identification/1; null where a number is not finite."""
        numerator, denominator = self.discrete()
        names = list(self.parameters)
        return {
            "schema": SCHEMA,
            "unit": self.unit,
            "direction": self.direction,
            "method": self.method,
            "parameters": {name: parameter.to_dict() for name, parameter in self.parameters.items()},
            "offsets": {name: parameter.to_dict() for name, parameter in self.offsets.items()},
            "delay_s": self.delay_s.to_dict(),
            "correlation": {
                "names": names,
                "matrix": [[finite_or_none(value) for value in row] for row in self.correlation],
            },
            "fit_percent": finite_or_none(self.fit_percent),
            "rmse": {"value": finite_or_none(self.rmse), "unit": self.rmse_unit},
            "iterations": self.iterations,
            "converged": self.converged,
            "residual_tests": {name: test.to_dict() for name, test in self.residual_tests.items()},
            "discrete": {
                "sample_rate_hz": self.sample_rate_hz,
                "numerator": [float(value) for value in numerator],
                "denominator": [float(value) for value in denominator],
            },
            "structure": self.structure,
            "initial_states": {name: state.to_dict() for name, state in self.initial_states.items()},
            "fit_percent_by_recording": {
                name: finite_or_none(value) for name, value in self.fit_percent_by_recording.items()
            },
            "covariance": [[finite_or_none(value) for value in row] for row in self.covariance],
            "reading_unit": self.reading_unit.symbol,
            "scale": self.scale,
            "n_samples": self.n_samples,
            "n_missing": self.n_missing,
            "load_range_n": list(self.load_range_n),
            "rate_range_n_per_s": list(self.rate_range_n_per_s),
            "estimator": self.estimator,
            "load_offsets": {name: parameter.to_dict() for name, parameter in self.load_offsets.items()},
            "noise": {name: parameter.to_dict() for name, parameter in self.noise.items()},
            "consistency": self.consistency.to_dict() if self.structure == "free" else None,
            "notes": list(self.notes),
        }


@on_one_thread
def fit_percent(y: Array, error: Array) -> float:
    """100 (1 - ||error||/||y - mean y||), as in MATLAB's ``compare``."""
    spread = float(np.linalg.norm(y - y.mean())) if y.size else 0.0
    return 100.0 * (1.0 - float(np.linalg.norm(error)) / spread) if spread > 0 else float("nan")
