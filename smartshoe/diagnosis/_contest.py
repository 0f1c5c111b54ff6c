"""A cause against its rival: how well this data, and this data with a simulated experiment, separates them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

from smartshoe.arrays import Array
from smartshoe.diagnosis._experiments import sessions_on
from smartshoe.diagnosis._likelihood import FEW_STEPS, Fit, Likelihood, evaluated, fit, rows_of, within_bounds
from smartshoe.diagnosis._naming import odds_of_law
from smartshoe.diagnosis._session import Session
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.extended import ExtendedModel
from smartshoe.protocol import Protocol


def predicted_session(unit: ExtendedModel, protocol: Protocol, sample_time_s: float, thresholds: Thresholds) -> Session:
    """The prepared recording that ``unit`` is predicted to give under the protocol."""
    (session,), _ = sessions_on(unit, [protocol], unit.full_scale_load_n, sample_time_s, thresholds)
    return session


Predict = Callable[[ExtendedModel, Protocol, float, Thresholds], Session]  # `predicted_session`, or one that keeps them


@dataclass(frozen=True, eq=False)
class Contest:
    """Three fits to the same data: with the ``cause``, with a ``rival`` in its place, and ``without`` either."""

    cause: Fit
    rival: Fit
    without: Fit

    @property
    def margin(self) -> float:
        """By how much -2 log likelihood is higher with the rival than with the cause."""
        return self.rival.cost - self.cause.cost

    @property
    def log_odds(self) -> float:
        """Log odds of the cause against the rival, by `odds_of_law`: no law is taken as exact."""
        return self._log_odds_of(self.margin)

    def _log_odds_of(self, margin: float) -> float:
        """The log odds at a given ``margin``."""
        ratio = self.without.cost - self.cause.cost
        return -math.log(max(float(odds_of_law(margin, ratio, self.cause.likelihood.thresholds)), 1e-300))

    def refitted(self) -> Contest:
        """The same with the rival fitted further: it came from a comparison of many, which uses few steps."""
        return replace(self, rival=fit(self.cause.likelihood, self.rival.model, FEW_STEPS))

    def after_experiment(
        self,
        protocol: Protocol,
        sample_time_s: float,
        min_margin_gain: float = -math.inf,
        min_log_odds: float = -math.inf,
        predict: Predict = predicted_session,
    ) -> Contest | None:
        """The contest once the protocol is run, logged every ``sample_time_s``, on a unit with the cause as fitted.

        The rival is refitted to both, the new recording's own offset and memory free; the model without either starts
        from the cause, as in a diagnosis. None where the margin grows by at most ``min_margin_gain``, or the log odds
        reach at most ``min_log_odds``. Both are bounded before any fit, since refitting only reduces what the rival
        misses.
        """
        known, model = self.cause.likelihood, self.cause.model
        session = predict(model, protocol, sample_time_s, known.thresholds)
        predicted_miss = Likelihood((session,), known.noise_sd, model, known.thresholds).cost(self.rival.model)
        if predicted_miss <= min_margin_gain or self._log_odds_of(self.margin + predicted_miss) <= min_log_odds:
            return None
        both = Likelihood((*known.sessions, session), known.noise_sd, model, known.thresholds)
        cause = evaluated(both, model)

        def fitted(start: ExtendedModel, rows: list[Array]) -> Fit:
            return fit(both, start, FEW_STEPS, [*rows, rows_of(start, session)], best_cost=cause.cost)

        rival = fitted(*self._rival_start)
        if rival.cost - cause.cost - self.margin <= min_margin_gain:
            return None
        return Contest(cause, rival, fitted(*self._without_start))

    @cached_property
    def _rival_start(self) -> tuple[ExtendedModel, list[Array]]:
        """The rival's model and its rows of this data, from which each refit starts."""
        return self._warm_start(self.rival.model)

    @cached_property
    def _without_start(self) -> tuple[ExtendedModel, list[Array]]:
        """The model of the cause without it and its rows of this data, from which each refit starts."""
        model = self.cause.model
        return self._warm_start(model.without(*({*model.names} - {*self.without.model.names})))

    def _warm_start(self, model: ExtendedModel) -> tuple[ExtendedModel, list[Array]]:
        """``model`` within its bounds, and its residuals and slopes over this data, which serve every protocol."""
        start = within_bounds(model)
        return start, [rows_of(start, one) for one in self.cause.likelihood.sessions]
