"""Effects with memory of the load: loops, turning points, cycles, largest load; what noise and pauses leave alone."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq
from test_effects_wall import soft_by_twin

from smartshoe.arrays import Array
from smartshoe.kernels.memory import _along, _place_of, bouc_wen_branch
from smartshoe.models.effects._wall_memory import LEAST_DEAD_ZONE, dead_zone
from smartshoe.models.effects.catalogue import effect
from smartshoe.models.effects.effect import Conditions

STEP_S = 0.02
PLAY = np.array([0.02, 0.06, 0.5, 0.6, 0.0])
STOPS = np.array([0.02, 0.06, 0.8, 0.6, 1.0])
BOUC_WEN = np.array([0.02, 0.08, 1.5, 0.5, 0.0])
LOOPS = (("play_hysteresis", PLAY), ("play_hysteresis", STOPS), ("bouc_wen_hysteresis", BOUC_WEN))
MEMORIES = (
    *LOOPS,
    ("load_unload_asymmetry", np.array([0.02, 0.005])),
    ("mullins_softening", np.array([0.03, 0.3, 0.0, 0.0, 1.0, 0.0])),
    ("mullins_softening", np.array([0.03, 0.3, 0.7, 1.0, 0.6, 0.3])),
    ("cycle_conditioning", np.array([0.03, 3.0, 0.0, 1.0])),
    ("cycle_conditioning", np.array([0.03, 3.0, 0.4, 0.5])),
)
turning_points = st.lists(st.floats(0.0, 1.0), min_size=3, max_size=8)


def between(loads: list[float], samples: int = 200) -> Array:
    """Straight lines between ``loads``, ``samples`` each, from zero."""
    return np.interp(np.arange(len(loads) * samples + 1) / samples, np.arange(len(loads) + 1), [0.0, *loads])


def run(name: str, values: Array, load: Array, noise: float = 0.0, **before: float) -> Array:
    """The block's output (n,) for a load (n,)."""
    return effect(name).apply(
        load, Conditions(STEP_S * np.arange(load.size), load, STEP_S, noise, before=before), values
    )


@pytest.mark.parametrize(("name", "values"), LOOPS)
def test_half_of_the_major_loop_is_the_strength(name: str, values: Array) -> None:
    load = between([1.0, 0.0, 1.0, 0.0], 1000)
    out = run(name, values, load)
    up, down = out[2000:3001], out[3000:][::-1]
    height = 0.5 * np.max(down - up)
    # Bouc-Wen and the widest stops do not come to their end value within full scale.
    assert height == pytest.approx(values[0], rel=2e-3 if name == "play_hysteresis" and values[4] == 0.0 else 0.1)
    assert np.all(down - up >= -1e-12)


@given(st.floats(0.6, 5.0), st.floats(0.0, 2.0), st.floats(-0.999, 0.999))
@settings(max_examples=60, deadline=None)
def test_a_place_on_the_branch_is_that_of_a_plain_bisection(exponent: float, turn: float, value: float) -> None:
    z, slope = np.empty(241), np.empty(241)
    bouc_wen_branch(exponent, turn, 10.0 / 240, z, slope)
    low, high = 0.0, 240.0
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _along(middle, z, slope) < value else (low, middle)
    assert _place_of(value, z, slope) == pytest.approx(0.5 * (low + high), abs=1e-12)


@pytest.mark.parametrize(("name", "values"), LOOPS)
@given(loads=turning_points, pace=st.integers(2, 9))
@settings(max_examples=10)
def test_loops_do_not_depend_on_rate(name: str, values: Array, loads: list[float], pace: int) -> None:
    slow, fast = between(loads, 180), between(loads, 180 // pace)
    corners = np.arange(len(loads) + 1)
    at_slow, at_fast = run(name, values, slow)[180 * corners], run(name, values, fast)[(180 // pace) * corners]
    assert np.max(np.abs(at_slow - at_fast)) <= 1e-12


@pytest.mark.parametrize(("name", "values"), LOOPS)
@given(loads=turning_points)
@settings(max_examples=10)
def test_friction_takes_work_over_any_closed_path(name: str, values: Array, loads: list[float]) -> None:
    # Twice round, so that the second round begins and ends in the same state.
    path = between([*loads, 0.0, *loads, 0.0], 400)
    friction = path - run(name, values, path)
    second = slice(path.size // 2, None)
    work = np.sum(0.5 * (friction[second][1:] + friction[second][:-1]) * np.diff(path[second]))
    assert work >= -1e-9


@pytest.mark.parametrize("values", [PLAY, STOPS])
@given(high=st.floats(0.4, 1.0), share=st.floats(0.1, 0.9))
@settings(max_examples=10)
def test_a_minor_loop_of_plays_closes_and_is_forgotten(values: Array, high: float, share: float) -> None:
    low = share * high
    with_loop = run("play_hysteresis", values, between([high, low, high, 0.3 * low], 300))
    without = run("play_hysteresis", values, between([high, 0.3 * low], 300))
    assert with_loop[900] == pytest.approx(with_loop[300], abs=1e-12)
    assert with_loop[-1] == pytest.approx(without[-1], abs=1e-12)


def test_a_closed_loop_reads_zero_without_load_and_an_open_one_keeps_friction() -> None:
    path = between([1.0, 0.0])
    assert run("play_hysteresis", PLAY, path)[-1] == pytest.approx(0.0, abs=1e-12)
    assert run("play_hysteresis", STOPS, path)[-1] == pytest.approx(STOPS[0], rel=0.02)
    assert run("bouc_wen_hysteresis", BOUC_WEN, path)[-1] == pytest.approx(BOUC_WEN[0], rel=0.02)


@pytest.mark.parametrize("fading", [0.3, 0.8, 1.0])
def test_friction_fades_with_the_load_as_it_is_said_to(fading: float) -> None:
    path = between([-0.1, 1.2, 0.0, 0.5], 200)
    plain, faded = (
        run("bouc_wen_hysteresis", np.array([0.02, 0.03, 1.5, 0.5, share]), path) for share in (0.0, fading)
    )
    left = np.clip(1.0 - fading * path, 0.0, 1.0)
    np.testing.assert_allclose(path - faded, (path - plain) * left, atol=1.1 * 0.02 * LEAST_DEAD_ZONE)


@pytest.mark.parametrize(("name", "values"), MEMORIES)
def test_noise_at_rest_and_in_a_hold_moves_no_memory(name: str, values: Array) -> None:
    noise = 0.001
    quiet = between([0.0, 0.0, 0.7, 0.7, 0.7, 0.7, 0.7, 0.3, 0.3, 0.3, 0.3, 0.0, 0.5], 800)
    noisy = quiet + noise * np.random.default_rng(2).standard_normal(quiet.size)
    # The noise that passes straight through is not the memory's: take the load off.
    with_noise = run(name, values, noisy, noise) - noisy
    for hold in (slice(2600, 5600), slice(6600, 8800)):
        late, early = with_noise[hold][-600:].mean(), with_noise[hold][:600].mean()
        assert abs(late - early) <= 0.02 * values[0]
    without = run(name, values, quiet, noise) - quiet
    spread = float(np.max(np.abs(without)))
    assert np.sqrt(np.mean((with_noise - without) ** 2)) <= 0.15 * spread


@pytest.mark.parametrize(("name", "values"), MEMORIES)
@given(loads=turning_points, pause=st.integers(1, 500))
@settings(max_examples=8)
def test_a_pause_changes_nothing(name: str, values: Array, loads: list[float], pause: int) -> None:
    load = between(loads, 100)
    at = 100 * (len(loads) // 2)
    paused = np.concatenate([load[:at], np.full(pause, load[at]), load[at:]])
    out = run(name, values, paused)
    assert np.array_equal(np.concatenate([out[:at], out[at + pause :]]), run(name, values, load))


def test_unloading_lacks_the_gain_it_is_said_to_lack() -> None:
    out = run("load_unload_asymmetry", np.array([0.1, 0.005]), between([1.0, 0.0], 1000))
    load = between([1.0, 0.0], 1000)
    assert out[500] == pytest.approx(load[500], rel=1e-12)
    assert out[1500] == pytest.approx(0.9 * load[1500], rel=1e-9)


def test_size_grows_with_rate_in_both_directions() -> None:
    values = np.array([0.1, 1.0])
    for rate_per_s in (0.1, 0.5, 1.0):
        samples = round(1.0 / rate_per_s / STEP_S)
        load = between([1.0, 0.0], samples)
        out = run("rate_gain", values, load)
        for at in (samples // 2, 3 * samples // 2):
            # Below 1 % of full scale a second the power is rounded off, which takes that much from every rate.
            assert out[at] / load[at] == pytest.approx(1.0 + 0.1 * rate_per_s, abs=1.1e-3)


def test_only_the_first_loading_to_a_level_is_stiff() -> None:
    values = np.array([0.05, 0.3, 0.0, 0.0, 1.0, 0.0])
    load = between([0.5, 0.0, 0.5, 1.0, 0.0, 1.0], 500)
    out = run("mullins_softening", values, load)
    assert out[250] == pytest.approx(load[250], abs=1e-12)  # virgin
    assert out[1250] > load[1250] + 1e-3  # half of the level, again
    assert out[1250] == pytest.approx(out[750], abs=1e-12)  # as it was on the way down
    assert out[1900] == pytest.approx(load[1900], abs=1e-12)  # beyond the largest so far: virgin again
    assert out[2250] / load[2250] == pytest.approx(1.05, abs=1e-3)  # half of full scale after full scale


def test_a_damaged_wall_is_straight_below_its_largest_load_and_bends_beyond() -> None:
    values = np.array([0.05, 0.3, 1.0, 0.0, 1.0, 0.0])
    load = between([0.5, 0.0, 0.5, 1.0, 0.0], 500)
    out = run("mullins_softening", values, load)
    gain = out / np.where(load == 0.0, np.inf, load)
    once, more = (1.0 + 0.05 * np.tanh(most**2 / 0.3) / np.tanh(2.5) for most in (0.5, 1.0))
    assert gain[500] == pytest.approx(once, abs=1e-4)
    assert gain[550:900] == pytest.approx(np.full(350, once), abs=1e-4)  # down
    assert gain[1100:1490] == pytest.approx(np.full(390, once), abs=1e-4)  # up again
    assert np.all(np.diff(gain[1510:1900]) > 0.0)  # further than ever
    assert gain[2400] == pytest.approx(more, abs=1e-4)


@given(
    gained=st.floats(1e-3, 1.0), width=st.floats(0.02, 3.0), at_once=st.sampled_from([0.0, 0.3, 1.0]),
    widening=st.floats(0.0, 3.0), power=st.sampled_from([1.0, 0.5, 0.8]), before=st.floats(0.0, 1.5),
    loads=st.lists(st.floats(-0.5, 1.5), min_size=2, max_size=6), noise=st.sampled_from([0.0, 1e-3]),
)  # fmt: skip
@example(1.0, 0.5, 0.0, 0.0, 0.5, 0.5, [-0.5, 0.0], 0.0)  # Newton's steps go to and fro across the corner
@example(0.625, 1.5, 0.0, 0.0, 1.0, 1.5, [0.5, 0.0], 0.0)  # a last step as large as may be
@settings(max_examples=40)
def test_softened_rubber_bears_the_load_to_the_last_digit(
    gained: float,
    width: float,
    at_once: float,
    widening: float,
    power: float,
    before: float,
    loads: list[float],
    noise: float,
) -> None:
    """The kernel against bisection, sample by sample: steep bends, jumps, pulls, whatever came before."""
    load = between(loads, 15) + noise * np.random.default_rng(1).standard_normal(15 * len(loads) + 1)
    values = np.array([gained, width, at_once, widening, power, 0.0])
    out = run("mullins_softening", values, load, noise, largest_load=before)
    zone = dead_zone(Conditions(np.zeros(1), load, STEP_S, noise))
    below, raised = (1.0 - at_once) * gained, at_once * gained / np.tanh(0.75 / width)
    amount = below / (1.0 + below) / soft_by_twin(0.75 / (width + widening), power)
    assume(amount * soft_by_twin((1.5 * (1.0 + raised)) ** 2 / width, power) < 0.95)  # else it bears no load

    def rise(most: float) -> float:
        return float(1.0 + raised * np.tanh(most * most / width))

    largest = before
    for f, u in zip(load, out, strict=True):
        largest = max(largest, f)
        most = max(largest - zone, 0.0)
        if f >= most:  # virgin
            assert u == pytest.approx(f * rise(f), rel=1e-15)
            continue
        highest, given_, wide = most * rise(most), f * rise(most), width + widening * most * most

        def off(v: float, f: float = given_, most: float = highest, wide: float = wide) -> float:
            return float(v * (1.0 - amount * soft_by_twin(max(most**2 - v * v, 0.0) / wide, power)) - f)

        low, high = (given_, highest) if f > 0.0 else (20.0 * given_, given_)
        assert u == pytest.approx(brentq(off, low, high, xtol=1e-14), abs=1e-10)


def test_by_the_root_of_the_distance_a_wall_is_soft_at_once() -> None:
    """Beatty and Krishnaswamy: a little below its largest load it has lost much of what it will ever lose."""
    load = between([1.0, 0.0, 1.0], 1000)
    by_energy, by_root = (run("mullins_softening", np.array([0.05, 1.0, 0.0, 0.0, p, 0.0]), load) for p in (1.0, 0.5))
    at = 1050  # at 0.95 of full scale, back from it
    assert by_root[at] / load[at] - 1.0 > 2.0 * (by_energy[at] / load[at] - 1.0)
    assert by_root[1500] == pytest.approx(by_energy[1500], abs=1e-3)  # "gained" is of half of full scale, of either


def test_cycles_are_counted_whatever_their_rate_and_height_and_ripples_are_not() -> None:
    values = np.array([0.1, 2.0, 0.0, 1.0])
    load = between([0.3, 0.0, 1.0, 0.0, 0.5, 0.49, 0.5, 0.0, 0.2, 0.0, 0.03, 0.0, 0.5], 137)
    out = run("cycle_conditioning", values, load)
    assert out[-1] / load[-1] == pytest.approx(1.0 + 0.1 * -np.expm1(-4.0 / 2.0), rel=1e-12)


@pytest.mark.parametrize(
    ("name", "values", "key"),
    [
        ("mullins_softening", np.array([0.05, 0.3, 0.0, 0.5, 0.7, 0.5]), "largest_load"),
        ("mullins_softening", np.array([0.05, 0.3, 1.0, 0.0, 1.0, 0.0]), "largest_load"),
        ("cycle_conditioning", np.array([0.05, 3.0, 0.0, 1.0]), "cycles"),
        ("cycle_conditioning", np.array([0.05, 3.0, 1.0, 1.0]), "way"),
        ("permanent_set", np.array([1e-3, 1.0]), "dose"),
    ],
)
def test_a_recording_that_continues_another_begins_where_it_ended(name: str, values: Array, key: str) -> None:
    first, second = between([0.8, 0.0, 0.6, 0.0]), between([0.5, 0.0, 1.0])
    whole = run(name, values, np.concatenate([first, second[1:]]))
    way = 1.4 - 4 * LEAST_DEAD_ZONE  # what a play of that half width lets through: less after each reversal
    left_behind = {"largest_load": 0.8, "cycles": 2.0, "way": way, "dose": float(np.trapezoid(first, dx=STEP_S))}
    continued = run(name, values, second, **{key: left_behind[key]})
    assert np.max(np.abs(continued[1:] - whole[first.size :])) <= 1e-12


def test_by_the_way_a_gain_settles_within_a_cycle_and_keeps_still_in_holds() -> None:
    load = between([0.8, 0.8, 0.2, 0.2, 1.0])
    gained = run("cycle_conditioning", np.array([0.1, 2.0, 1.0, 1.0]), load)[1:] / load[1:] - 1.0
    way = 0.5 * np.concatenate([[0.0], np.cumsum(np.abs(np.diff(load)))])[1:]
    assert np.max(np.abs(gained - 0.1 * -np.expm1(-way / 2.0))) < 0.1 / 2.0 * 3 * LEAST_DEAD_ZONE
    still = np.diff(load[1:]) == 0.0
    assert still.any()
    assert np.all(np.diff(gained)[still] == 0.0)


def test_a_stretched_settling_is_fast_at_first_and_for_long_not_over() -> None:
    load = between([1.0, 0.0] * 12, 40)
    at = 40 * (2 * np.array([1, 2, 4, 11]) + 1)  # the peaks after so many cycles

    def gained(stretch: float) -> Array:
        return run("cycle_conditioning", np.array([0.1, 2.0, 0.0, stretch]), load)[at] - 1.0

    assert gained(0.5) == pytest.approx(0.1 * -np.expm1(-np.sqrt(np.array([0.5, 1.0, 2.0, 5.5]))), rel=1e-12)
    assert gained(0.5)[0] > gained(1.0)[0]
    assert gained(0.5)[1] == pytest.approx(gained(1.0)[1])  # 63 % of it after as many cycles, of either
    assert gained(0.5)[3] < gained(1.0)[3]


@pytest.mark.parametrize(("height", "counted"), [(0.085, True), (0.075, False)])
def test_a_cycle_counts_from_eight_percent_of_full_scale_on(height: float, counted: bool) -> None:
    load = between([height, 0.0, height, 0.0, 0.5], 50)
    gain = run("cycle_conditioning", np.array([0.1, 2.0, 0.0, 1.0]), load)[-1] / load[-1]
    assert gain == pytest.approx(1.0 + 0.1 * -np.expm1(-2.0 / 2.0) if counted else 1.0, rel=1e-12)


def test_a_load_below_zero_sets_nothing_and_takes_no_set_back() -> None:
    values = np.array([1e-2, 2.0])
    pressed = between([0.0, 0.8, 0.8, 0.0], 100)
    pulled = between([0.0, -0.8, -0.8, 0.0], 100)
    assert np.array_equal(run("permanent_set", values, pulled), pulled)
    whole = run("permanent_set", values, np.concatenate([pressed, pulled[1:]]))
    assert whole[pressed.size - 1] > 1e-3
    assert whole[-1] == pytest.approx(whole[pressed.size - 1], abs=1e-12)
