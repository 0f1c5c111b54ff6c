"""`identify`: one unit's model from one or more experiments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from numbers import Real
from typing import Literal, get_args

import numpy as np

from smartshoe.arrays import Mask, require_positive
from smartshoe.errors import NotConvergedError, NotIdentifiableError, UsageError
from smartshoe.files.logs.accepted import RecordingLike, recordings_of, unit_of
from smartshoe.identification._conclude import Choice, conclude
from smartshoe.identification._estimator import Estimator, estimate
from smartshoe.identification._experiment import Direction, prepare
from smartshoe.identification._identification import Identification
from smartshoe.identification._parametrisation import GREY_FIXED, FreeForm, GreyBox, Parametrisation, Structure
from smartshoe.identification._prediction_error import LARGEST_DELAY_S, PredictionError, Settings
from smartshoe.kernels.blas import on_one_thread
from smartshoe.recording import Recording
from smartshoe.units import Unit

Method = Literal["srivc", "gn", "lm", "trf"]
Free = Literal["estimate"]


@on_one_thread
def identify(  # noqa: PLR0913 - a public verb
    recordings: RecordingLike | Sequence[RecordingLike],
    *,
    direction: Direction = "inverse",
    method: Method = "trf",
    structure: Structure = "free",
    estimator: Estimator = "auto",
    offset: float | Free = "estimate",
    load_offset_n: float | Free = 0.0,
    delay: float | Free = "estimate",
    initial_state: Literal["estimate", "steady"] = "estimate",
    fixed: Mapping[str, float] | None = None,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    reading_noise: float | Free = "estimate",
    load_noise_n: float | Free = "estimate",
    prefilter_rad_s: float = 1.0,
    scale: float | Free | None = None,
    counted: Mapping[str, Mask] | None = None,
    tolerance: float = 1e-9,
    max_iterations: int = 500,
    strict: bool = True,
) -> Identification:
    """Identify force / reading = (b0 s + b1)/(s + a1) of one unit (Chinimilli 2016, Section V).

    Parameters
    ----------
    recordings
        Experiments of the unit: recordings, paths or DataFrames.
    direction : {"inverse", "forward"}
        Which signal's error is minimised: the load's, as in the paper, or the reading's. The parameters are those of
        equation (13) in both cases.
    method : {"trf", "gn", "lm", "srivc"}
        SRIVC alone, or one of the others started from it, which share one residual and gradient.
    structure : {"free", "grey_box"}
        "free" fits a1, b0, b1; "grey_box" k1 and k2, with c = 1 and x_over_nrt as the paper has them unless ``fixed``
        names others.
    estimator : {"auto", "output_error", "errors_in_variables", "command", "cycles"}
        "output_error" takes the input as exact; "errors_in_variables" allows for noise on both; "command" and "cycles"
        take their instruments from the commanded load or from the mean of the other repeats; "auto" fits the first and
        then another where the input's noise would move the result by a tenth of its error bar, with a note.
    offset, delay, initial_state
        Reading at no load (one per recording), time in s by which the reading is later than the load, and the state at
        the first sample: estimated, or fixed.
    load_offset_n
        The load cell's zero in N. It cannot be distinguished from the reading's offset, so one of the two is fixed.
    fixed, bounds
        Parameters of the structure that are known, and limits of those that are free, by name.
    reading_noise, load_noise_n
        Standard deviations of white noise, in the reading's unit and in N: known, or estimated.
    prefilter_rad_s
        SRIVC's first lambda.
    scale
        N per reading unit of the paper's force: by default the recordings' ``effective_area_m2``, else 1; "estimate"
        fits it (grey box only).
    counted
        By recording name the samples (n,) whose error counts.
    tolerance, max_iterations
        The relative change that ends the iteration, and the steps it may take.
    strict
        Whether an iteration that did not settle is an error.

    Raises
    ------
    NotIdentifiableError
        Where the data cannot hold the answer.
    NotConvergedError
        Where the iteration did not settle, unless ``strict`` is False.
    RefusedError
        Where an estimator lacks what it needs.
    InputError, UsageError
        For wrong input.

    Examples
    --------
    >>> import smartshoe
    >>> with smartshoe.open_machine("sim:instron", unit="left_toe", seed=1) as machine:
    ...     pressed = machine.run(smartshoe.dynamic_protocol((100.0, 400.0)))
    >>> found = smartshoe.identify(pressed)
    >>> round(found.parameters["a1"].value, 2)  # 1/s
    0.21
    >>> toe = found.calibration(unit="left_toe")
    """
    several = recordings_of(recordings)
    _check_choices(direction, method, structure, initial_state, estimator)
    require_positive(prefilter_rad_s, "prefilter_rad_s")
    require_positive(tolerance, "tolerance")
    require_positive(max_iterations, "max_iterations")
    experiments, reading_unit = prepare(several, counted)
    newtons, scale_note = _scale(several, reading_unit, scale, structure)
    settings = _settings(direction, offset, load_offset_n, delay, initial_state)
    form = _form(structure, direction, newtons, fixed, bounds)
    noise = {"load": _sd("load_noise_n", load_noise_n), "reading": _sd("reading_noise", reading_noise)}
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        try:
            fit = estimate(
                PredictionError(experiments, settings, form),
                several,
                method,
                estimator,
                noise,
                prefilter_rad_s=prefilter_rad_s,
                tolerance=tolerance,
                max_iterations=max_iterations,
            )
        except NotIdentifiableError as error:  # the solver does not know whose signals these are
            raise NotIdentifiableError(f"{several[0].label}: {error}") from error
        if not np.isfinite(fit.theta).all() or not np.isfinite(fit.cost):
            raise NotIdentifiableError(
                f"{several[0].label}: the fit runs to infinity: record a load that rises and falls at several rates"
            )
    choice = Choice(
        unit=_unit_name(several),
        method=method,
        structure=structure,
        reading_unit=reading_unit,
        newtons=newtons,
        load_zero_free=isinstance(load_offset_n, str),
        sources=tuple(recording.source or recording.name for recording in several),
    )
    # Where undetermined parameters kept the fit from converging, report that as the reason.
    found = conclude(replace(fit, notes=(scale_note, *fit.notes)), choice, several[0].label)
    if strict and not fit.converged:
        raise NotConvergedError(
            f"{several[0].label}: {method} did not settle within {max_iterations} iterations: raise max_iterations,"
            " or choose another method or prefilter_rad_s"
        )
    return found


def _check_choices(direction: str, method: str, structure: str, initial_state: str, estimator: str) -> None:
    for name, value, known in (
        ("direction", direction, get_args(Direction)),
        ("method", method, get_args(Method)),
        ("structure", structure, get_args(Structure)),
        ("estimator", estimator, get_args(Estimator)),
        ("initial_state", initial_state, ("estimate", "steady")),
    ):
        if value not in known:
            raise UsageError(f"{name} {value!r} is not known: use one of {', '.join(known)}")
    if method == "srivc" and structure == "grey_box":
        raise UsageError("srivc fits three free coefficients: use gn, lm or trf for the grey box")
    if method == "srivc" and estimator not in ("auto", "output_error"):
        raise UsageError(f"srivc has an instrument of its own: use gn, lm or trf with estimator {estimator}")


def _fixed(name: str, value: float | str) -> float | None:
    """``value`` as a number, or None where it is "estimate"."""
    if value == "estimate":
        return None
    if not isinstance(value, Real) or not np.isfinite(value):
        raise UsageError(f"{name} is {value!r}: give a finite number or 'estimate'")
    return float(value)


def _sd(name: str, value: float | str) -> float | None:
    number = _fixed(name, value)
    if number is not None and number < 0:
        raise UsageError(f"{name} is {number:g}: give a standard deviation, 0 or above")
    return number


def _settings(
    direction: Direction, offset: float | str, load_offset_n: float | str, delay: float | str, initial_state: str
) -> Settings:
    zero, load_zero, delay_s = _fixed("offset", offset), _fixed("load_offset_n", load_offset_n), _fixed("delay", delay)
    if zero is None and load_zero is None:
        raise UsageError("offset and load_offset_n are one number to this model: fix one of them")
    if delay_s is not None and abs(delay_s) > LARGEST_DELAY_S:
        raise UsageError(f"delay is {delay_s:g} s: give one within {LARGEST_DELAY_S:g} s")
    return Settings(
        direction=direction,
        offset=zero,
        load_offset_n=load_zero or 0.0,
        free_constant=zero is None or load_zero is None,
        delay_s=delay_s,
        steady=initial_state == "steady",
    )


def _form(
    structure: Structure,
    direction: Direction,
    newtons: float | None,
    fixed: Mapping[str, float] | None,
    bounds: Mapping[str, tuple[float, float]] | None,
) -> Parametrisation:
    # With a free scale the grey box is equivalent to the free form, interpreted with c = 1.
    if structure == "free" or newtons is None:
        if fixed or bounds:
            raise UsageError("fixed and bounds belong to the grey box: set structure to 'grey_box' and give a scale")
        return FreeForm(direction)
    return GreyBox(direction, newtons, dict(GREY_FIXED if fixed is None else fixed), dict(bounds or {}))


def _unit_name(recordings: Sequence[Recording]) -> str:
    return unit_of(recordings, "identify") or unit_of(recordings, "identify", lambda one: one.sensor.name)


def _scale(
    recordings: Sequence[Recording], reading_unit: Unit, scale: float | str | None, structure: str
) -> tuple[float | None, str]:
    """N per reading unit of the paper's force (None to estimate it), and its origin in one sentence."""
    if isinstance(scale, str):
        if scale != "estimate" or structure != "grey_box":
            raise UsageError(f"scale is {scale!r}: give a number, or 'estimate' with structure 'grey_box'")
        return None, "scale was estimated, with c = 1"
    if scale is not None:
        if not (np.isfinite(scale) and scale != 0):
            raise UsageError(f"scale is {scale:g}: give a finite number other than 0")
        return float(scale), "scale was given by the caller"
    areas = {recording.metadata.get("effective_area_m2") for recording in recordings}
    text = areas.pop() if len(areas) == 1 else None
    if text is None or reading_unit.quantity != "pressure":
        return 1.0, "scale is 1: the reading is taken in the paper's force units"
    area_m2 = recordings[0].positive("effective_area_m2", "m2")
    return area_m2 * reading_unit.scale, f"scale follows from effective_area_m2 = {area_m2:g}"
