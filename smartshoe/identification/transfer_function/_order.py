"""Selects the model order: YIC, BIC and the error on held-out data, over a grid of structures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np

from smartshoe.arrays import Array
from smartshoe.errors import NotIdentifiableError, RefusedError, UsageError
from smartshoe.identification.transfer_function._estimate import TransferFunctionEstimate
from smartshoe.identification.transfer_function._experiment import as_signals, prepare
from smartshoe.identification.transfer_function._identify import identify_transfer_function
from smartshoe.identification.transfer_function._problem import OutputError, Structure

Criterion = Literal["bic", "yic", "held_out"]


@dataclass(frozen=True)
class OrderCandidate:
    """One structure. ``estimate`` uses all data, None where ``refused`` gives the reason; lower criteria are better.

    ``yic`` is Young's information criterion ln(sd_e^2/sd_y^2) + ln(mean of sd^2/theta^2), which weighs the fit against
    the uncertainty of its coefficients (Young and Jakeman 1980; Young 1989). ``bic`` is n ln(rmse^2) + p ln n (Schwarz
    1978). ``held_out_rmse``, in y's unit, is the error on data that was not fitted.
    """

    poles: int
    zeros: int
    yic: float
    bic: float
    held_out_rmse: float
    estimate: TransferFunctionEstimate | None
    refused: str = ""


@dataclass(frozen=True)
class OrderSelection:
    """All ``candidates``, the best by ``criterion`` first, refused ones last."""

    candidates: tuple[OrderCandidate, ...]
    criterion: Criterion

    @property
    def best(self) -> TransferFunctionEstimate:
        """The estimate of the best candidate."""
        found = self.candidates[0].estimate
        if found is None:
            raise NotIdentifiableError(f"no structure could be fitted: {self.candidates[0].refused}")
        return found


def select_order(
    u: Any,
    y: Any,
    *,
    poles: Sequence[int] = (1, 2, 3, 4),
    zeros: Sequence[int] | None = None,
    criterion: Criterion = "bic",
    held_out_share: float = 0.3,
    sample_time_s: float | None = None,
    time_s: Any = None,
    **options: Any,
) -> OrderSelection:
    """Fit each of ``poles`` with each of ``zeros`` (by default all below) and order them by ``criterion``.

    Parameters
    ----------
    u, y, sample_time_s, time_s, **options
        As in `identify_transfer_function`.
    poles, zeros
        The degrees to try.
    criterion
        The criterion by which structures are ordered.
    held_out_share
        Several experiments are left out one at a time; of a single one, this share at its end. What is left out keeps
        its own offset and initial state, as every experiment does, and its error counts the freedom that they take.

    Returns
    -------
    OrderSelection
        A structure that the data cannot hold is listed with the reason.

    Raises
    ------
    NotIdentifiableError
        Where none can be fitted.
    """
    if criterion not in get_args(Criterion):
        raise UsageError(f"criterion is {criterion!r}: give one of {', '.join(get_args(Criterion))}")
    if not 0.0 < held_out_share < 1.0:
        raise UsageError(f"held_out_share is {held_out_share}: give a number between 0 and 1")
    data = _Experiments(u, y, sample_time_s, time_s)
    candidates = [
        _candidate(data, n, m, held_out_share, options)
        for n in poles
        for m in (range(n) if zeros is None else [one for one in zeros if one <= n])
    ]
    if not candidates:
        raise UsageError("no structure to try: give poles, and zeros no more than them")
    key = {"bic": "bic", "yic": "yic", "held_out": "held_out_rmse"}[criterion]
    ranked = sorted(candidates, key=lambda one: (one.estimate is None, getattr(one, key)))
    selection = OrderSelection(tuple(ranked), criterion)
    if ranked[0].estimate is None:
        raise NotIdentifiableError(f"no structure could be fitted: {ranked[0].refused}")
    return selection


class _Experiments:
    """The experiments as lists, which can be split."""

    def __init__(self, u: Any, y: Any, sample_time_s: float | None, time_s: Any) -> None:
        self.u, self.y, self.sample_time_s = as_signals(u, "u"), as_signals(y, "y"), sample_time_s
        self.time_s = None if time_s is None else as_signals(time_s, "time_s")
        if self.time_s is not None and len(self.time_s) == 1:
            self.time_s = self.time_s * len(self.u)

    def part(self, chosen: Sequence[tuple[int, slice]]) -> dict[str, Any]:
        """Arguments for a fit of the ``chosen`` experiments' slices."""
        times = None if self.time_s is None else [self.time_s[index][part] for index, part in chosen]
        return {
            "u": [self.u[index][part] for index, part in chosen],
            "y": [self.y[index][part] for index, part in chosen],
            "sample_time_s": self.sample_time_s,
            "time_s": times,
        }

    def splits(self, share: float) -> list[tuple[list[tuple[int, slice]], tuple[int, slice]]]:
        """Pairs of the parts to fit and the part to hold out."""
        count = len(self.u)
        if count > 1:
            every = slice(None)
            return [([(i, every) for i in range(count) if i != out], (out, every)) for out in range(count)]
        at = round((1.0 - share) * self.u[0].size)
        return [([(0, slice(0, at))], (0, slice(at, None)))]


def _candidate(data: _Experiments, poles: int, zeros: int, share: float, options: dict[str, Any]) -> OrderCandidate:
    everything = data.part([(index, slice(None)) for index in range(len(data.u))])
    try:
        whole = identify_transfer_function(**everything, poles=poles, zeros=zeros, **options)
        squares, freedom = 0.0, 0
        for fitted, left_out in data.splits(share):
            estimate = identify_transfer_function(**data.part(fitted), poles=poles, zeros=zeros, **options)
            error, used = _held_out(data.part([left_out]), estimate, options, single=len(data.u) == 1)
            squares += float(error @ error)
            freedom += error.size - used
    except RefusedError as refusal:
        return OrderCandidate(poles, zeros, np.inf, np.inf, np.inf, None, str(refusal))
    size = whole.sd.size + (whole.delay_sd_s > 0.0)
    theta = np.concatenate([whole.numerator, whole.denominator[1:]])
    signal = np.concatenate([one[np.isfinite(one)] - np.nanmean(one) for one in data.y])
    with np.errstate(divide="ignore"):
        yic = float(np.log(whole.rmse**2 / np.mean(signal**2)) + np.log(np.mean((whole.sd / theta) ** 2)))
        bic = float(whole.n_samples * np.log(whole.rmse**2) + size * np.log(whole.n_samples))
    held_out_rmse = float(np.sqrt(squares / max(freedom, 1)))
    return OrderCandidate(poles, zeros, yic, bic, held_out_rmse, whole)


def _held_out(
    part: dict[str, Any], estimate: TransferFunctionEstimate, options: dict[str, Any], *, single: bool
) -> tuple[Array, int]:
    """Error on the held-out experiment, and the number of its own unknowns that were fitted to it."""
    experiments, _ = prepare(**part, hold=estimate.intersample, strict=False)
    offset = options.get("offset", "estimate")
    problem = OutputError(
        experiments,
        Structure(
            poles=estimate.denominator.size - 1,
            zeros=estimate.numerator.size - 1,
            hold=estimate.intersample,
            # When a record is cut in two, the second part does not begin at rest.
            initial_state="estimate" if single else options.get("initial_state", "estimate"),
            offset=None if offset == "estimate" else float(offset),
        ),
        delayed=False,
        delay_s=estimate.delay_s,
    )
    look = problem.look(np.concatenate([estimate.numerator, estimate.denominator[1:]]))[0]
    counted = experiments[0].counted[problem.firsts[0] :]
    return look.error[counted], look.nuisance.basis.shape[1]
