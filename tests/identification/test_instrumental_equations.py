"""The equations by instruments, sum by sum: what stands in for the input, which samples count, and Newton's steps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from presses import TOE, coefficients, press

from smartshoe.errors import NotIdentifiableError, RefusedError
from smartshoe.identification._experiment import Experiment, prepare
from smartshoe.identification._instruments import Instruments, _inverse, _merit, solve_instrumental
from smartshoe.identification._prediction_error import PredictionError, Settings
from smartshoe.models.first_order import shifted, simulate

Array = NDArray[np.float64]

PLAIN = Settings(offset=0.0, free_constant=False, delay_s=0.0, steady=True)
A1, B0, B1 = coefficients(*TOE)
THETA = np.array([np.log(A1), B0, B1 / A1])
FORWARD = np.array([np.log(B1 / B0), 1.0 / B0, A1 / B1])


@pytest.fixture(scope="module")
def pressed() -> Experiment:
    (experiment,), _ = prepare([press(load_noise=2.0, reading_noise=1.0, command=True, rates=(400.0, 800.0))])
    return experiment


def _command(experiment: Experiment) -> Array:
    assert experiment.command_n is not None
    return experiment.command_n.copy()


def _only(experiment: Experiment, kept: Array) -> Experiment:
    """The command known at ``kept`` places alone."""
    command_n = np.full(experiment.load_n.size, np.nan)
    command_n[kept] = _command(experiment)[kept]
    return replace(experiment, command_n=command_n)


# -- which samples count -------------------------------------------------------------------------------------------
def test_samples_count_where_the_command_is_known_and_the_recording_counts(pressed: Experiment) -> None:
    command_n, mask = _command(pressed), pressed.mask.copy()
    command_n[100:130], mask[120:160] = np.nan, False
    instruments = Instruments(PredictionError([replace(pressed, command_n=command_n, mask=mask)], PLAIN), "command")
    (usable,) = instruments.usable
    assert np.flatnonzero(~usable).tolist() == list(range(100, 160))
    assert instruments.count == usable.size - 60


def test_samples_count_where_other_repeats_have_a_mean(pressed: Experiment) -> None:
    means, mask = pressed.reading.copy(), pressed.mask.copy()
    means[:50], mask[40:80] = np.nan, False
    problem = PredictionError([replace(pressed, mask=mask, command_n=None)], PLAIN)
    instruments = Instruments(problem, "cycles", [means])
    assert np.flatnonzero(~instruments.usable[0]).tolist() == list(range(80))
    assert not problem.masks[0][60]
    assert problem.masks[0][20]


@pytest.mark.parametrize(("share", "follows"), [(0.60, False), (0.36, True)])
def test_a_command_follows_from_a_correlation_of_nine_tenths_on(
    pressed: Experiment, share: float, follows: bool
) -> None:
    """A load about a third of whose command is something else correlates with it by 1/sqrt(1 + share^2)."""
    load = pressed.load_n - pressed.load_n.mean()
    other = np.random.default_rng(1).standard_normal(load.size)
    other -= other @ load / (load @ load) * load + (other - other @ load / (load @ load) * load).mean()
    command_n = load + share * other * np.linalg.norm(load) / np.linalg.norm(other)
    # Of thousandths of a newton it follows as well.
    problem = PredictionError([replace(pressed, command_n=1e-6 * command_n)], PLAIN)
    if follows:
        assert Instruments(problem, "command").count == load.size
    else:
        with pytest.raises(RefusedError, match=r"correlation 0\.8[56]"):
            Instruments(problem, "command")


@pytest.mark.parametrize("level", [0.0, 5.0])
def test_a_command_that_stands_still_does_not_follow(pressed: Experiment, level: float) -> None:
    still = replace(pressed, command_n=np.full(pressed.load_n.size, level))
    with pytest.raises(RefusedError, match=r"correlation 0\.00"):
        Instruments(PredictionError([still], PLAIN), "command")


def test_two_samples_of_a_command_say_nothing_of_how_it_follows(pressed: Experiment) -> None:
    rising = np.flatnonzero(np.diff(_command(pressed)) > 1.0)
    two, three = rising[[50, 150]], rising[[50, 100, 150]]
    with pytest.raises(RefusedError, match="does not follow"):
        Instruments(PredictionError([_only(pressed, two)], PLAIN), "command")
    with pytest.raises(NotIdentifiableError, match="no load cycle"):
        Instruments(PredictionError([_only(pressed, three)], PLAIN), "command")


def test_more_than_two_samples_an_unknown_are_needed(pressed: Experiment) -> None:
    rising = np.flatnonzero(np.diff(_command(pressed)) > 1.0)[::20]
    with pytest.raises(NotIdentifiableError, match="no load cycle"):
        Instruments(PredictionError([_only(pressed, rising[:6])], PLAIN), "command")
    assert Instruments(PredictionError([_only(pressed, rising[:7])], PLAIN), "command").count == 7


# -- what stands in for the input ------------------------------------------------------------------------------------
def test_forward_the_command_itself_stands_in_and_a_delay_moves_it_back(pressed: Experiment) -> None:
    command_n = _command(pressed)
    known = command_n.copy()
    command_n[205:220] = np.nan
    bridged = np.interp(np.arange(known.size), np.flatnonzero(np.isfinite(command_n)), known[np.isfinite(command_n)])
    problem = PredictionError([replace(pressed, command_n=command_n)], replace(PLAIN, direction="forward"))
    u, slope = Instruments(problem, "command")._stand_in(FORWARD, 0)
    assert u == pytest.approx(bridged)
    assert slope == pytest.approx(-np.gradient(bridged, pressed.time_s))


def test_inverse_the_reading_under_the_command_stands_in(pressed: Experiment) -> None:
    problem = PredictionError([pressed], PLAIN)
    u, slope = Instruments(problem, "command")._stand_in(THETA, 0)
    reading = simulate(B1 / B0, 1.0 / B0, A1 / B0, _command(pressed), pressed.time_s)
    assert u == pytest.approx(reading, rel=1e-9, abs=1e-9)
    assert slope == pytest.approx(np.gradient(reading, pressed.time_s), abs=1e-6)


def test_the_mean_of_other_repeats_stands_in_with_the_zero_out_and_the_delay_undone(pressed: Experiment) -> None:
    options = replace(PLAIN, offset=7.0, delay_s=0.013)
    means = 0.5 * pressed.reading + 3.0
    means[300:310] = np.nan
    instruments = Instruments(PredictionError([pressed], options), "cycles", [means])
    filled = np.where(np.isfinite(means), means, pressed.reading) - 7.0
    wanted = shifted(filled, pressed.time_s, pressed.step, 0.013)
    for own, other in zip(instruments._stand_in(THETA, 0), wanted, strict=True):
        assert own == pytest.approx(other)
    plain = Instruments(PredictionError([pressed], replace(options, offset=None)), "cycles", [means])
    assert plain._stand_in(THETA, 0)[0] == pytest.approx(wanted[0] + 7.0)


@pytest.mark.parametrize(("direction", "theta"), [("inverse", THETA), ("forward", FORWARD)])
def test_the_equations_are_sums_over_the_samples_that_count(pressed: Experiment, direction: str, theta: Array) -> None:
    command_n = _command(pressed)
    command_n[100:130] = np.nan
    several = [replace(pressed, command_n=command_n), replace(pressed, name="again")]
    problem = PredictionError(several, replace(PLAIN, direction=direction))  # type: ignore[arg-type]
    instruments = Instruments(problem, "command")
    right, normal, power, cost = instruments.equations(theta)
    z, j, e = [], [], []
    for index, usable in enumerate(instruments.usable):
        error, slopes = problem.error_and_slopes(theta, index)
        own = problem.error_and_slopes(theta, index, instruments._stand_in(theta, index))[1]
        z.append(own[:, usable])
        j.append(slopes[:, usable])
        e.append(error[usable])
    along, jacobian, error = np.concatenate(z, axis=1), np.concatenate(j, axis=1), np.concatenate(e)
    assert right == pytest.approx(along @ error)
    assert normal == pytest.approx(along @ jacobian.T)
    assert power == pytest.approx(along @ along.T)
    assert cost == pytest.approx(float(error @ error))
    assert _merit((right, normal, power, cost)) == pytest.approx(float(right @ np.linalg.solve(power, right)))
    assert _merit((right, normal, np.full((3, 3), np.nan), cost)) == np.inf


# -- Newton's steps ------------------------------------------------------------------------------------------------
def _steps(instruments: Instruments, begun: Array, **limits: float) -> tuple[Array, Array, float, int, bool]:
    options = {"tolerance": 1e-9, "max_iterations": 1, **limits}
    return solve_instrumental(instruments, begun, np.ones(begun.size), **options)  # type: ignore[arg-type]


def test_near_the_root_a_step_is_newtons(pressed: Experiment) -> None:
    instruments = Instruments(PredictionError([pressed], PLAIN), "command")
    begun = THETA + np.array([0.05, 0.01, 0.0])
    right, normal, _, _ = instruments.equations(begun)
    moved, covariance, variance, steps, _ = _steps(instruments, begun)
    assert steps == 1
    assert moved == pytest.approx(begun - np.linalg.solve(normal, right), abs=1e-9)
    _, normal, power, cost = instruments.equations(moved)
    assert variance == pytest.approx(cost / (instruments.count - 3))
    inverse = np.linalg.inv(normal)
    assert covariance == pytest.approx(variance * inverse @ power @ inverse.T)


def test_of_few_samples_the_unknowns_are_taken_off_in_the_variance(pressed: Experiment) -> None:
    rising = np.flatnonzero(np.diff(_command(pressed)) > 1.0)[::20]
    instruments = Instruments(PredictionError([_only(pressed, rising[:12])], PLAIN), "command")
    moved, _, variance, _, _ = _steps(instruments, THETA + np.array([0.01, 0.0, 0.0]))
    assert variance == pytest.approx(instruments.equations(moved)[3] / 9.0)


@pytest.mark.parametrize("off", [1.5, -1.5])
def test_far_from_the_root_the_longest_step_that_halves_what_is_left_is_taken(pressed: Experiment, off: float) -> None:
    """Of half a unit of ln alpha, a quarter, an eighth and a sixteenth; of none, the one that leaves least."""
    instruments = Instruments(PredictionError([pressed], PLAIN), "command")
    begun = THETA + np.array([off, 0.2, 0.3])
    seen = instruments.equations(begun)
    newton = np.linalg.solve(seen[1], seen[0])
    longest = min(1.0, 0.5 / abs(newton[0]))
    trials = [begun - longest * 0.5**k * newton for k in range(4)]
    left = [_merit(instruments.equations(trial)) for trial in trials]
    enough = [k for k in range(4) if left[k] < 0.5 * _merit(seen)]
    best = enough[0] if enough else int(np.argmin(left))
    assert _steps(instruments, begun)[0] == pytest.approx(trials[best], abs=1e-9)


def test_it_ends_settled_where_a_step_is_a_hundred_thousandth_of_an_error(pressed: Experiment) -> None:
    instruments = Instruments(PredictionError([pressed], PLAIN), "command")
    root, covariance, _, steps, converged = _steps(instruments, THETA, max_iterations=50, tolerance=1e-300)
    sd = np.sqrt(np.diag(covariance))
    assert converged
    assert 1 < steps < 10
    assert np.abs(np.linalg.solve(*reversed(instruments.equations(root)[:2])) / sd).max() < 1e-5
    few = _steps(instruments, THETA + 0.1, max_iterations=2, tolerance=1e-300)
    assert (few[3], few[4]) == (2, False)
    # By the relative change too, whatever the error bars say.
    again = solve_instrumental(instruments, root + 1e-4, np.zeros(3), tolerance=1e-2, max_iterations=50)
    assert (again[3], again[4]) == (1, True)


def test_an_inverse_is_one_in_any_units_and_of_what_has_none_it_is_told() -> None:
    plain = np.array([[2.0, 0.5, 0.1], [0.3, 1.0, -0.2], [0.0, 0.4, 3.0]])
    units = np.array([1e-9, 1.0, 1e9])
    scaled = plain * np.outer(units, units)
    assert _inverse(scaled) * np.outer(units, units) == pytest.approx(np.linalg.inv(plain), rel=1e-9)
    turned = np.array([[0.0, 2.0], [4.0, 0.0]])
    assert _inverse(turned) == pytest.approx(np.linalg.inv(turned))
    with pytest.raises(NotIdentifiableError, match="do not determine"):
        _inverse(np.ones((2, 2)))
