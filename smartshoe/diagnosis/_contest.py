"""What an experiment is foretold to tell of a cause and its rival: both fitted to what it would read."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

from smartshoe.arrays import Array
from smartshoe.diagnosis._experiments import EXPERIMENTS, sessions_on
from smartshoe.diagnosis._likelihood import FEW_STEPS, Fit, Likelihood, fit, rows_of, weighed, within_bounds
from smartshoe.diagnosis._naming import odds_of_law
from smartshoe.diagnosis._session import Session
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.extended import ExtendedModel
from smartshoe.protocol import Protocol


@dataclass(frozen=True, eq=False)
class Contest:
    """The ``cause`` as it is fitted, a ``rival`` in its place, and the model ``without`` either, all to the same data.

    ``margin``: of -2 log likelihood, by which the rival follows worse. ``log_odds`` of the cause against the rival, as
    a diagnosis weighs laws: no law is exact, and one that lacks less than laws usually depart by is as good.
    """

    cause: Fit
    rival: Fit
    without: Fit

    @property
    def margin(self) -> float:
        return self.rival.cost - self.cause.cost

    @property
    def log_odds(self) -> float:
        return self._log_odds_of(self.margin)

    def _log_odds_of(self, margin: float) -> float:
        fall = self.without.cost - self.cause.cost
        return -math.log(max(float(odds_of_law(margin, fall, self.cause.likelihood.thresholds)), 1e-300))

    def settled(self) -> Contest:
        """The same, the rival fitted on, as `after` does: so far only as a comparison of many asks for."""
        return replace(self, rival=fit(self.cause.likelihood, self.rival.model, FEW_STEPS))

    def after(
        self, protocol: Protocol, sample_time_s: float, least: float = -math.inf, of_use: float = -math.inf
    ) -> Contest | None:
        """The same were the protocol run once, logged every ``sample_time_s``, and the cause as it was fitted true.

        The rival is fitted on to this data and that, the new recording's own offset and past free; what is without
        either begins from the cause, as in a diagnosis. None where the margin grows by no more than ``least``, or the
        log odds come to no more than ``of_use``: however the rival is fitted on, it misses no more of that recording
        than it does as it is, and what is without either falls behind by no less than now.
        """
        known, model = self.cause.likelihood, self.cause.model
        session = _foretold(model, protocol, sample_time_s, known.thresholds)
        missed = Likelihood((session,), known.noise_sd, model, known.thresholds).cost(self.rival.model)
        if missed <= least or self._log_odds_of(self.margin + missed) <= of_use:
            return None
        both = Likelihood((*known.sessions, session), known.noise_sd, model, known.thresholds)
        cause = weighed(both, model)

        def fitted(start: ExtendedModel, rows: list[Array]) -> Fit:
            return fit(both, start, FEW_STEPS, [*rows, rows_of(start, session)], beside=cause.cost)

        rival = fitted(*self._of_rival)
        if rival.cost - cause.cost - self.margin <= least:
            return None
        return Contest(cause, rival, fitted(*self._of_less))

    @cached_property
    def _of_rival(self) -> tuple[ExtendedModel, list[Array]]:
        return self._begun(self.rival.model)

    @cached_property
    def _of_less(self) -> tuple[ExtendedModel, list[Array]]:
        model = self.cause.model
        return self._begun(model.without(*({*model.names} - {*self.without.model.names})))

    def _begun(self, model: ExtendedModel) -> tuple[ExtendedModel, list[Array]]:
        """Where a fit begins, whatever protocol is run, and what it begins with of this data."""
        start = within_bounds(model)
        return start, [rows_of(start, one) for one in self.cause.likelihood.sessions]


@lru_cache(maxsize=len(EXPERIMENTS))
def _foretold(unit: ExtendedModel, protocol: Protocol, sample_time_s: float, thresholds: Thresholds) -> Session:
    """What the unit would read, prepared; kept, since each of its doubtful causes asks for the same protocols."""
    (session,), _ = sessions_on(unit, [protocol], unit.full_scale_load_n, sample_time_s, thresholds)
    return session
