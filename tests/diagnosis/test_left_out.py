"""What is left out in turn is predicted by fits to the rest, and effects that do not follow it are taken out."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import least_squares

from smartshoe.diagnosis import Thresholds, _validation
from smartshoe.diagnosis._likelihood import FEW_STEPS, Fit, Likelihood, fit
from smartshoe.diagnosis._own_terms import residual_of
from smartshoe.diagnosis._scale import full_scale
from smartshoe.diagnosis._session import Session, prepare
from smartshoe.diagnosis._validation import MOST_FOLDS, LeftOut, cancelling_effects, error_of
from smartshoe.models.effects import Conditions, effect
from smartshoe.models.extended import ExtendedModel
from smartshoe.recording import Recording

Array = NDArray[np.float64]

STEP_S, SD = 0.05, 0.002
STANDARD = Thresholds()
MODEL = ExtendedModel(1.0, 0.08, 0.22, 800.0, 140.0, "mbar")
TIME_S = np.arange(0.0, 80.0, STEP_S)


def _run(model: ExtendedModel, seed: int) -> Recording:
    """Cycles to other peaks in each recording."""
    rng = np.random.default_rng([seed, 5])
    corners = np.zeros(17)
    corners[1::2] = rng.uniform(0.4, 1.0, 8)
    corners[1] = 1.0
    load = np.interp(TIME_S, 5.0 * np.arange(17), corners)
    share = model.simulate(Conditions(TIME_S, load, STEP_S)) + SD * rng.standard_normal(TIME_S.size)
    return Recording.from_arrays(time_s=TIME_S, force_n=800.0 * load, pressure_mbar=140.0 * share, name=f"run_{seed}")


def _sessions(truths: list[ExtendedModel]) -> list[Session]:
    runs = [_run(truth, seed) for seed, truth in enumerate(truths)]
    usable = [one.sensor.present for one in runs]
    return prepare(runs, usable, [False] * len(runs), full_scale(runs, usable, STANDARD), [1], STANDARD)


def _curved(amount: float) -> ExtendedModel:
    return MODEL.with_part(effect("gas_compression"), np.array([amount]))


def _fitted(sessions: list[Session], *names: str) -> ExtendedModel:
    model = MODEL
    for name in names:
        model = model.with_part(effect(name), effect(name).begun())
    return fit(Likelihood(sessions, SD, MODEL, STANDARD), model).model


def _left_out(sessions: list[Session], thresholds: Thresholds = STANDARD) -> LeftOut:
    return LeftOut(sessions, SD, MODEL, thresholds)


def test_a_recording_is_predicted_by_a_fit_to_the_others() -> None:
    """By hand: SciPy's least squares on the others, each with an offset of its own."""
    sessions = _sessions([_curved(0.08)] * 3)
    model = _fitted(sessions, "gas_compression")
    errors = _left_out(sessions).errors(model)
    for k, session in enumerate(sessions):
        rest = [one for one in sessions if one is not session]

        def residuals(theta: Array, rest: list[Session] = rest) -> Array:
            return np.concatenate([residual_of(one, model.at(theta)) for one in rest])

        slow = model.at(least_squares(residuals, model.theta, x_scale="jac").x)
        assert errors[k] == pytest.approx(float(np.sum(residual_of(session, slow) ** 2)), rel=0.02)


def test_of_a_single_recording_blocks_of_its_cycles_are_left_out() -> None:
    sessions = _sessions([_curved(0.08)])
    errors = _left_out(sessions).errors(_fitted(sessions, "gas_compression"))
    assert errors.size == min(MOST_FOLDS, np.unique(sessions[0].cycle).size)
    noise = residual_of(sessions[0], _fitted(sessions, "gas_compression"))
    assert float(noise @ noise) < float(errors.sum())  # every sample once, and none of it was fitted
    assert float(errors.sum()) < 0.5 * float(_left_out(sessions).errors(_fitted(sessions)).sum())


def test_of_many_recordings_each_has_its_error_by_a_fit_without_its_group(monkeypatch: pytest.MonkeyPatch) -> None:
    sessions = _sessions([_curved(0.08)] * 13)
    model, fits = _fitted(sessions, "gas_compression"), []

    def counted(*given: Any) -> Fit:
        fits.append(fit(*given))
        return fits[-1]

    monkeypatch.setattr(_validation, "fit", counted)
    errors = _left_out(sessions).errors(model)
    assert (errors.size, len(fits)) == (13, MOST_FOLDS)
    for found in fits:
        gone = [one for one in sessions if not any(one is other for other in found.likelihood.sessions)]
        for one in gone:
            expected = float(np.sum(residual_of(one, found.model) ** 2))
            assert np.isclose(errors, expected, rtol=1e-12).sum() == 1


def test_the_truth_stands_and_what_is_not_there_or_only_fits_does_not() -> None:
    sessions = _sessions([_curved(0.1)] * 3)
    left_out, plain = _left_out(sessions), _fitted(sessions)
    assert left_out.is_validated(_fitted(sessions, "gas_compression"), plain)
    assert not left_out.is_validated(_fitted(sessions, "load_unload_asymmetry"), plain)
    assert not left_out.is_validated(plain, plain)
    # Two recordings that a drift of the gain happens to fit, each in its own way.
    rising, falling = (
        MODEL.with_part(effect("gain_drift"), np.array([slope, 0.0, 60.0, 0.0, 1.0])) for slope in (0.002, -0.0004)
    )
    chance = _sessions([rising, falling])
    model, bare = _fitted(chance, "gain_drift"), _fitted(chance)
    errors = [float(_left_out(chance).errors(one).sum()) for one in (model, bare)]
    assert _left_out(chance).is_validated(model, bare) == (errors[0] < (1.0 - STANDARD.foreseen) * errors[1])
    assert not _left_out(chance).is_validated(model, bare)


def test_what_follows_as_a_law_does_needs_to_foresee_less(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of two recordings one may not hold all that an effect needs; what fits only in part must do as well elsewhere."""
    sessions = _sessions([_curved(0.3)] * 2)
    plain, law = _fitted(sessions), _fitted(sessions, "gas_compression")
    # A law that is held away from its optimum leaves more than a law does.
    half = law.at(np.where(np.arange(law.theta.size) == law.theta.size - 1, 0.17, law.theta))
    left_out = _left_out(sessions)
    shares = [1.0 - (error_of(sessions, one) / error_of(sessions, plain)) ** 2 for one in (law, half)]
    assert shares[0] > 1.0 - STANDARD.law_departure**2 > shares[1] > STANDARD.foreseen
    for foreseen, stand in ((STANDARD.foreseen + 0.01, (True, False)), (STANDARD.foreseen - 0.01, (False, False))):
        monkeypatch.setattr(
            left_out, "errors", lambda one, way, left=1.0 - foreseen: np.array([1.0 if one is plain else left])
        )
        assert (left_out.is_validated(law, plain), left_out.is_validated(half, plain)) == stand
    monkeypatch.setattr(left_out, "errors", lambda one, way: np.array([1.0 if one is plain else 1.0 - shares[1]]))
    assert left_out.is_validated(half, plain)


def _following(sessions: list[Session], model: ExtendedModel, thresholds: Thresholds = STANDARD) -> tuple[str, ...]:
    found = fit(Likelihood(sessions, SD, MODEL, thresholds), model)
    return _left_out(sessions, thresholds).consistent(found).model.names


def test_an_effect_that_is_not_there_is_taken_out_and_one_that_is_stays() -> None:
    there, gone = _sessions([_curved(0.1)] * 4), _sessions([_curved(0.0)] * 4)
    assert _following(there, _fitted(there, "gas_compression")) == ("gas_compression",)
    assert _following(gone, _fitted(gone, "gas_compression")) == ()
    assert _following(there, MODEL) == ()


def test_an_effect_of_another_size_in_each_recording_must_gain_more_than_chance() -> None:
    """It fits all of them at its mean, and says little of the next."""
    changing = _sessions([_curved(0.1), MODEL, _curved(0.1), MODEL])
    model = _fitted(changing, "gas_compression")
    # Its own strength is that of the others, all else what all of them ask for.
    less = fit(Likelihood(changing, SD, MODEL, STANDARD), model.without("gas_compression")).model
    gains = np.empty(4)
    for k, session in enumerate(changing):
        rest = Likelihood([one for one in changing if one is not session], SD, MODEL, STANDARD)
        own = fit(rest, model, only_effect="gas_compression").model
        errors = [float(np.sum(residual_of(session, one) ** 2)) for one in (less, own)]
        gains[k] = errors[0] - errors[1]
    sure = float(np.mean(gains) / (np.std(gains, ddof=1) / np.sqrt(gains.size)))
    for validated, names in ((sure - 0.02, ("gas_compression",)), (sure + 0.02, ())):
        assert _following(changing, model, replace(STANDARD, validated=validated)) == names


def test_of_two_that_fail_that_one_goes_first_that_gains_least(monkeypatch: pytest.MonkeyPatch) -> None:
    sessions = _sessions([_curved(0.1)] * 3)
    model = _fitted(sessions, "gas_compression", "delay")
    impossible = _left_out(sessions, replace(STANDARD, validated=1e9))
    fitted: list[tuple[str, ...]] = []

    def kept(likelihood: Likelihood, start: ExtendedModel, steps: int = 25, *known: Any, **beside: Any) -> Fit:
        if steps > FEW_STEPS:
            fitted.append(start.names)
        return fit(likelihood, start, steps, *known, **beside)

    monkeypatch.setattr(_validation, "fit", kept)
    assert impossible.consistent(fit(Likelihood(sessions, SD, MODEL, STANDARD), model)).model.names == ()
    assert fitted == [("delay",), ("gas_compression",), ()]  # without each of them, then without the curve beside none


@pytest.mark.parametrize("reverse", [1.0, -1.0])
def test_effects_that_fit_by_their_difference_undo_one_another(reverse: float) -> None:
    """A drift of the zero that another one takes back: powers of 10 and 9 beside that of 1."""
    sessions = _sessions([MODEL] * 2)
    per_s = reverse * 0.01 / TIME_S[-1]
    drift, warm, gain = effect("zero_drift"), effect("warm_up"), effect("gain_drift")
    slow = np.array([-reverse * 0.009 * 300.0 / TIME_S[-1], 300.0, 1.0])  # a line with the other sign, nearly
    along = slow * np.array([-1.0, 1.0, 1.0])
    against = MODEL.with_part(drift, np.array([per_s, 0.0, 0.0, 1.0])).with_part(warm, slow)
    assert cancelling_effects(sessions, against, STANDARD) == ["zero_drift", "warm_up"]
    together = MODEL.with_part(drift, np.array([per_s, 0.0, 0.0, 1.0])).with_part(warm, along)
    assert cancelling_effects(sessions, together, STANDARD) == []
    # A small one beside them has no part in it.
    beside = against.with_part(gain, np.array([0.01 * abs(per_s), 0.0, 3.0, 0.0, 1.0]))
    assert cancelling_effects(sessions, beside, STANDARD) == ["zero_drift", "warm_up"]
    assert cancelling_effects(sessions, MODEL, STANDARD) == []
    assert cancelling_effects(sessions, MODEL.with_part(warm, slow), STANDARD) == []


def test_they_do_where_their_powers_are_clear_of_that_of_all_together() -> None:
    sessions = _sessions([MODEL] * 2)
    drift, warm = effect("zero_drift"), effect("warm_up")
    first, other = (np.array([1e-4, 0.0, 0.0, 1.0]), np.array([-1e-4 * 300.0, 300.0, 1.0]))

    def size(model: ExtendedModel) -> float:
        """Rms of a drift, each recording's mean aside."""
        moved = [model.simulate(one.conditions) - MODEL.simulate(one.conditions) for one in sessions]
        return float(np.sqrt(np.mean([np.var(one) for one in moved])))

    both = MODEL.with_part(drift, first).with_part(warm, 0.4 * other + np.array([0.0, 180.0, 0.6]))
    alone = (MODEL.with_part(drift, first), MODEL.with_part(warm, both.parts[1].values))
    ratio = sum(size(one) ** 2 for one in alone) / size(both) ** 2
    assert ratio > 1.5
    assert cancelling_effects(sessions, both, replace(STANDARD, clear=1.01 * ratio)) == []
    assert cancelling_effects(sessions, both, replace(STANDARD, clear=0.99 * ratio)) == ["zero_drift"]
