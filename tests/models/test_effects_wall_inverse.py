"""Inverses of the effects of contact, wall and gas: what went in comes back, for any chunking, and the same in C."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from smartshoe.arrays import Array
from smartshoe.models.effects._wall_memory import LEAST_DEAD_ZONE
from smartshoe.models.effects.catalogue import effect
from smartshoe.models.effects.effect import ChainContext, Conditions, CoreEffect, Effect
from smartshoe.models.elements import Arm

EXACT = (
    "gas_compression", "wall_hardening", "contact_area", "orifice_leak", "permanent_set", "mullins_softening",
    "play_hysteresis", "bouc_wen_hysteresis", "load_unload_asymmetry", "cycle_conditioning",
    "flexible_curve", "flexible_characteristic", "flexible_loop", "flexible_set", "flexible_asymmetry",
    "flexible_softening",
)  # fmt: skip
INVERTED = (*EXACT, "dead_band", "rate_gain")
STEP_S = 0.02
COMPILER = shutil.which("gcc") or shutil.which("cc")
FLAGS = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-pedantic", "-Wconversion", "-Wshadow"]
seeds = st.integers(0, 10_000)


def loading(seed: int, count: int = 16) -> Conditions:
    """Ramps between random loads, rests among them, at random rates."""
    generator = np.random.default_rng(seed)
    loads = generator.uniform(0.0, 1.0, count) * (generator.random(count) < 0.7)
    loads[0] = 0.0
    corners_s = np.concatenate([[0.0], np.cumsum(generator.uniform(0.3, 3.0, count - 1))])
    time_s = np.arange(0.0, corners_s[-1], STEP_S)
    return Conditions(time_s, np.interp(time_s, corners_s, loads), STEP_S)


def drawn(made: Effect, seed: int) -> Array:
    """Strengths of 0.3 to 3 sizes, shapes of the grid moved a little."""
    generator = np.random.default_rng(seed)
    values = made.start(made.shapes[int(generator.integers(len(made.shapes)))])
    for k, parameter in enumerate(made.parameters):
        if parameter.null is None:
            values[k] *= generator.uniform(0.8, 1.25)
        else:
            values[k] = parameter.null + parameter.size * generator.uniform(0.3, 3.0)
        values[k] = min(max(values[k], parameter.lower), parameter.upper)
    if made.name == "bouc_wen_hysteresis":  # more friction than this lets no load through after a reversal
        values[4] = generator.uniform(0.0, 1.0)
        values[0] = min(values[0], 0.5 * values[1] / (1.0 + values[3]))
    if made.name == "mullins_softening":  # its grid has no width that grows
        values[3] = generator.uniform(0.0, 2.0)
    return values


@pytest.mark.parametrize("name", EXACT)
@given(seed=seeds)
@settings(max_examples=6)
def test_what_went_in_comes_back(name: str, seed: int) -> None:
    made, given_ = effect(name), loading(seed)
    values = drawn(made, seed)
    out = made.apply(given_.load, given_, values)
    inverse = made.inverse(values, STEP_S)
    assert inverse is not None
    # 50 halvings of a bracket of the strength's size; or a cycle that counts a sample early or late, when the load is
    # within a sample's move of 5 % of the cycle's height.
    tolerance = 1e-9
    if name == "cycle_conditioning":
        tolerance = 1.2 * abs(values[0]) * (0.05 + float(np.max(np.abs(np.diff(given_.load)))))
    assert np.max(np.abs(inverse.push(out, given_.time_s) - given_.load)) <= tolerance


@pytest.mark.parametrize("name", ["contact_area", "wall_hardening", "gas_compression"])
@given(shares=st.lists(st.floats(0.0, 1.0), min_size=2, max_size=2))
@settings(max_examples=30)
def test_loads_beyond_full_scale_rise_on_and_come_back(name: str, shares: list[float]) -> None:
    """A curve that turned there would have no load for the readings above, and a twin that sheds load."""
    made = effect(name)
    values = np.array([p.lower + k * (p.upper - p.lower) for p, k in zip(made.parameters, shares, strict=False)])
    load = np.linspace(0.0, 5.0, 1000)
    given_ = Conditions(STEP_S * np.arange(load.size), load, STEP_S)
    out = made.apply(load, given_, values)
    inverse = made.inverse(values, STEP_S)
    assert inverse is not None
    assert np.min(np.diff(out)) > 0.0
    if made.bends_beside_arm:  # beside an arm that relaxes as well
        assert np.min(np.diff(made.apply(load, given_.within(0.1, 0.3), values))) > 0.0
    back = inverse.push(out, given_.time_s)
    assert np.max(np.abs(back - load)) <= 1e-8  # where it hardly rises, rounding counts more


@given(seed=seeds)
@settings(max_examples=10)
def test_dead_band_gives_back_every_load_that_it_lets_through(seed: int) -> None:
    made, given_ = effect("dead_band"), loading(seed)
    values = drawn(made, seed)
    out = made.apply(given_.load, given_, values)
    inverse = made.inverse(values, STEP_S)
    assert inverse is not None
    back = inverse.push(out, given_.time_s)
    through = given_.load > 1.5 * values[0]
    assert np.max(np.abs(back - given_.load)[through]) <= 1e-9
    assert np.max(np.abs(back - given_.load)) <= values[0]


@given(seed=seeds, gained=st.floats(0.01, 0.2), turn=st.floats(0.001, 0.02))
def test_where_unloading_gains_a_load_comes_back_once_it_has_turned(seed: int, gained: float, turn: float) -> None:
    """As the load turns two loads give one reading; the next sample that goes on tells which it is."""
    made, given_ = effect("load_unload_asymmetry"), loading(seed)
    values = np.array([-gained, turn])
    back = made.inverse(values, STEP_S)
    assert back is not None
    left = back.push(made.apply(given_.load, given_, values), given_.time_s) - given_.load
    way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(given_.load)))])
    last = np.maximum.accumulate(np.where(np.abs(np.diff(given_.load, 2, append=[0.0, 0.0])) > 1e-9, way, 0.0))
    gone = way - last > 10.0 * turn + 4.0 * LEAST_DEAD_ZONE + gained * given_.load
    assert np.max(np.abs(left), where=gone, initial=0.0) <= 1e-3 * gained
    assert np.max(np.abs(left)) <= gained


@given(seed=seeds)
@settings(max_examples=10)
def test_memory_takes_no_noise_for_a_load_that_turns(seed: int) -> None:
    """Of readings with noise the inverse that knows its size comes near the load, and one that does not far less so."""
    noise = 0.003 * np.random.default_rng(seed).standard_normal(5_000)
    time_s = np.arange(noise.size) * STEP_S
    given_ = Conditions(
        time_s, np.interp(time_s, [0.0, 20.0, 40.0, 60.0, 80.0, 100.0], [0.1, 0.9, 0.9, 0.2, 0.2, 0.9]), STEP_S
    )
    for name, values in (
        ("load_unload_asymmetry", np.array([-0.08, 0.005])),
        ("bouc_wen_hysteresis", np.array([0.02, 0.03, 1.0, 0.0, 0.0])),
    ):
        made = effect(name)
        read = made.apply(given_.load, given_, values) + noise
        off = []
        for known in (0.0, 0.003):
            back = made.inverse_within(ChainContext(Arm(0.1, 0.2), known), values, STEP_S)
            assert back is not None
            off.append(float(np.std(back.push(read, time_s) - given_.load - noise)))
        assert off[1] < 0.5 * off[0]


@given(seed=seeds, rate_per_s=st.floats(0.06, 1.0))
@settings(max_examples=10)
def test_rate_gain_gives_back_triangles_but_for_their_corners(seed: int, rate_per_s: float) -> None:
    # The inverse knows the rate of the loads before only: within 0.2 s of a corner it has the old rate in part.
    made = effect("rate_gain")
    values = drawn(made, seed)
    corners_s = np.array([0.0, 1.0, 1.0 + 1.0 / rate_per_s, 1.0 + 2.0 / rate_per_s, 2.0 + 2.0 / rate_per_s])
    time_s = np.arange(0.0, corners_s[-1], STEP_S)
    given_ = Conditions(time_s, np.interp(time_s, corners_s, [0.0, 0.0, 1.0, 0.0, 0.0]), STEP_S)
    inverse = made.inverse(values, STEP_S)
    assert inverse is not None
    left = inverse.push(made.apply(given_.load, given_, values), time_s) - given_.load
    far = np.min(np.abs(time_s[:, None] - corners_s), axis=1) > 0.25
    assert np.max(np.abs(left)) <= abs(values[0])
    assert np.max(np.abs(left[far])) <= 0.01 * abs(values[0])


@given(seed=seeds, share=st.floats(-0.5, 1.0), exponent=st.floats(0.4, 2.0))
@settings(max_examples=20)
def test_rate_gain_takes_no_more_than_half_and_gives_no_more_than_twice(
    seed: int, share: float, exponent: float
) -> None:
    made, given_ = effect("rate_gain"), loading(seed)
    fast = Conditions(given_.time_s / 10.0, given_.load, STEP_S / 10.0)  # up to 30 full scales a second
    values = np.array([share, exponent])
    out = made.apply(fast.load, fast, values)
    inverse = made.inverse(values, fast.step_s)
    assert inverse is not None
    back = inverse.push(out, fast.time_s)
    assert np.all(out >= 0.5 * fast.load)
    assert np.all((back >= 0.0) & (back <= 2.0 * out))


@pytest.mark.parametrize("name", INVERTED)
@given(seed=seeds, cuts=st.lists(st.floats(0.0, 1.0), max_size=6))
@settings(max_examples=6)
def test_any_chunking_gives_the_same_numbers(name: str, seed: int, cuts: list[float]) -> None:
    made, given_ = effect(name), loading(seed, 6)
    values = drawn(made, seed)
    out = made.apply(given_.load, given_, values)
    inverse = made.inverse(values, STEP_S)
    assert inverse is not None
    whole = inverse.push(out, given_.time_s)
    inverse.reset()
    at = sorted(int(cut * out.size) for cut in cuts)
    blocks = zip(np.split(out, at), np.split(given_.time_s, at), strict=True)
    assert np.array_equal(np.concatenate([inverse.push(*block) for block in blocks]), whole)


@pytest.mark.parametrize("name", INVERTED)
def test_nothing_is_undone_where_nothing_was_done(name: str) -> None:
    made, given_ = effect(name), loading(5)
    inverse = made.inverse(made.start(), STEP_S)
    assert inverse is not None
    assert np.max(np.abs(inverse.push(given_.load, given_.time_s) - given_.load)) <= 1e-12


def test_the_linear_network_is_inverted_as_a_whole() -> None:
    for name in ("second_relaxation", "power_law_creep", "linear_leak", "gas_heat"):
        assert isinstance(effect(name), CoreEffect)
        assert effect(name).inverse(effect(name).start(), STEP_S) is None


@pytest.mark.skipif(COMPILER is None, reason="no C compiler (gcc or cc) on the path")
def test_c_agrees_with_push() -> None:
    cases = {name: drawn(effect(name), 11) for name in INVERTED}
    cases["rate_gain"] = np.array([-0.5, 2.0])  # the fastest ramps meet its bound
    cases["wall_hardening"] = np.array([0.1, -0.3])  # a fifth power that would turn it down
    given_ = loading(7)
    outs = {name: effect(name).apply(given_.load, given_, values) for name, values in cases.items()}
    for name in ("contact_area", "wall_hardening"):
        outs[name] = 2.5 * outs[name] - 0.5  # also beyond full scale
    source = ["#include <math.h>"]
    for name, values in cases.items():
        inverse = effect(name).inverse(values, STEP_S)
        assert inverse is not None
        step = inverse.c_step(f"b_{name}")
        members = "".join(f"    double {member};\n" for member in step.states)
        starts = ", ".join(map(repr, step.states.values()))
        source += [
            f"typedef struct {{\n{members or '    double unused;'}\n}} {name}_filter;",
            f"void {name}(const double *from, double *out, long count);",
            f"void {name}(const double *from, double *out, long count)\n{{",
            f"    {name}_filter filter = {{{starts or '0.0'}}}, *f = &filter;\n    long row;",
            "    for (row = 0; row < count; row++) {\n    double x = from[row];\n    (void)f;",
            f"{step.body}\n    out[row] = x;\n    }}\n}}",
        ]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "steps.c"
        file.write_text("\n".join(source) + "\n")
        library = Path(folder) / "steps.so"
        command = [str(COMPILER), *FLAGS, "-shared", "-fPIC", str(file), "-o", str(library), "-lm"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        loaded = ctypes.CDLL(str(library))
        for name, values in cases.items():
            inverse = effect(name).inverse(values, STEP_S)
            assert inverse is not None
            y, in_c = np.ascontiguousarray(outs[name]), np.empty(given_.load.size)
            pointers = (ctypes.c_void_p(array.ctypes.data) for array in (y, in_c))
            getattr(loaded, name)(*pointers, ctypes.c_long(y.size))
            assert np.max(np.abs(in_c - inverse.push(y, given_.time_s))) <= 1e-12, name
