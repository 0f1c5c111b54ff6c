"""The extended filter in integers: every block against Python, its bounds, ends, arithmetic and size."""

from __future__ import annotations

import ctypes
import math
import re
import subprocess
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from c_code import ARM, CORES, compiled, macro, needs_arm, needs_compiler, run_filters
from chains import BASELINE, DRIFTS, INVERTIBLE, chain_of, some_conditions
from export_page import require_stated, stated
from hypothesis import given, settings
from hypothesis import strategies as st

from smartshoe.calibration import Calibration, extended_calibration
from smartshoe.calibration.export import export_files, export_shoe, write_files
from smartshoe.calibration.export._integer_functions import MOST, functions_text
from smartshoe.errors import UsageError
from smartshoe.models.effects import effect
from smartshoe.models.effects.effect import CStep

SAMPLES = 20_000
CHAIN = ["play_hysteresis", "linear_leak", "sensor_lag", "flexible_characteristic", "zero_drift"]
FRACTION = 46


def _readings(calibration: Calibration, seed: int) -> np.ndarray:
    """Loads over the full scale with noise in their readings."""
    readings = calibration.model().reading(some_conditions(seed, 160))[:SAMPLES]
    return readings + np.random.default_rng(seed).normal(0.0, 0.1, readings.size)


def _require_bounds(calibrations: dict[str, Calibration], fixed: str, folder: Path) -> dict[str, float]:
    """The C of each within both its bounds of Python; the worst error of each in N."""
    write_files(export_shoe(list(calibrations.values()), "c", fixed=fixed), folder)
    readings = {name: _readings(one, 5) for name, one in calibrations.items()}
    lsb = {name: macro(folder, f"{name}_INPUT_LSB") for name in calibrations}
    most = 2 ** int(fixed[1:]) - 1
    steps = {name: np.clip(np.rint(values / lsb[name]), -most - 1, most) for name, values in readings.items()}
    worst_n = {}
    for name, forces in run_filters(folder, steps).items():
        filter_, forces_n = calibrations[name].compensator(), forces * macro(folder, f"{name}_OUTPUT_LSB")
        said = re.search(r"\* (\S+) N for the integers pushed", (folder / f"{name}.h").read_text())
        assert said is not None
        assert np.max(np.abs(forces_n - filter_.apply(steps[name] * lsb[name]))) <= float(said[1]), name
        worst_n[name] = float(np.max(np.abs(forces_n - filter_.apply(readings[name]))))
        assert worst_n[name] <= macro(folder, f"{name}_ERROR_BOUND_N"), name
    return worst_n


@needs_compiler
def test_20_000_samples_of_every_block_in_32_bits(tmp_path: Path) -> None:
    calibrations = {name: extended_calibration(chain_of([name], 1), unit=name) for name in INVERTIBLE}
    # Of the bands that are drawn one whose loss sets in at once and is soon whole: it is the steepest at its edge.
    calibrations["dead_band"] = extended_calibration(chain_of(["dead_band"], 11), unit="dead_band")
    worst_n = _require_bounds(calibrations, "q31", tmp_path)
    print({name: f"{value:.2g} N" for name, value in worst_n.items()})
    assert max(worst_n.values()) <= 1e-3
    steep = ("sensor_lag", "flexible_lag", "rate_gain", "bouc_wen_hysteresis")
    require_stated("sensor and flexible lag, rate gain, Bouc-Wen", 1, max(worst_n[name] for name in steep))
    require_stated("dead band, at its edge", 1, worst_n["dead_band"])
    apart = {*steep, "dead_band", "load_unload_asymmetry"}  # the last one jumps: its error goes with the samples
    require_stated("readings rounded to their step", 1, max(x for name, x in worst_n.items() if name not in apart))
    assert "double" not in (tmp_path / "bouc_wen_hysteresis.c").read_text()


@needs_compiler
def test_chains_in_16_bits_keep_their_bounds(tmp_path: Path) -> None:
    chains = {
        "several": CHAIN,
        "asymmetric": ["load_unload_asymmetry", "gas_compression"],
        "band": ["dead_band"],
    }
    calibrations = {unit: extended_calibration(chain_of(names, 2), unit=unit) for unit, names in chains.items()}
    print(_require_bounds(calibrations, "q15", tmp_path))


@needs_compiler
def test_drifts_that_are_held_are_so_in_integers(tmp_path: Path) -> None:
    held = {name: chain_of([name], 11).held_after(20.0, ()) for name in DRIFTS}
    _require_bounds({name: extended_calibration(one, unit=name) for name, one in held.items()}, "q31", tmp_path)


@needs_compiler
def test_no_reading_of_the_type_leaves_the_integers(tmp_path: Path) -> None:
    names = [name for name in INVERTIBLE if name not in ("bouc_wen_hysteresis", "flexible_loop")]
    calibration = extended_calibration(chain_of(names, 1))
    write_files(export_files(calibration, "c", fixed="q31"), tmp_path)
    (tmp_path / "main.c").write_text(
        """#include "smartshoe_filter.h"

int main(void)
{
    smartshoe_filter filter;
    uint32_t state = 1;
    int k;

    smartshoe_filter_init(&filter);
    for (k = 0; k < 600; k++) {
        state = state * UINT32_C(1664525) + UINT32_C(1013904223);
        (void)smartshoe_filter_push(&filter, k % 7 == 0 ? INT32_MIN : (int32_t)(state >> 1));
        (void)smartshoe_filter_push(&filter, k % 5 == 0 ? INT32_MAX : k % 50);
    }
    return 0;
}
"""
    )
    # An overflow or a shift that C does not define ends the program.
    flags = ["-fsanitize=undefined", "-fsanitize-undefined-trap-on-error"]
    program = compiled([tmp_path / "smartshoe_filter.c", tmp_path / "main.c"], tmp_path / "run", *flags)
    assert subprocess.run([program], check=False).returncode == 0


@needs_compiler
def test_a_force_beyond_the_type_stays_at_its_end(tmp_path: Path) -> None:
    write_files(export_files(extended_calibration(chain_of(["sensor_lag"], 1)), "c", fixed="q15"), tmp_path)
    (forces,) = run_filters(tmp_path, {"smartshoe_filter": np.array([0, 32767, -32768])}).values()
    assert forces.tolist() == [0, 32767, -32768]


@needs_compiler
def test_the_self_test_knows_another_strength(tmp_path: Path) -> None:
    model = chain_of(CHAIN, 1)
    moved = model.at(model.theta * np.where(np.arange(model.theta.size) == 3, 1.01, 1.0))
    files, other = (export_files(extended_calibration(one), "c", fixed="q31") for one in (model, moved))
    for name, source in (("same", {}), ("moved", {"smartshoe_filter.c": other["smartshoe_filter.c"]})):
        folder = tmp_path / name
        write_files({**files, **source}, folder)
        sources = [folder / "smartshoe_filter.c", folder / "smartshoe_filter_test.c"]
        done = subprocess.run([compiled(sources, folder / "check")], check=False, capture_output=True)
        assert done.returncode == (name == "moved"), done.stdout


@needs_arm
def test_firmware_compilers_take_it_and_all_state_is_the_callers(tmp_path: Path) -> None:
    assert ARM is not None
    version = subprocess.run([ARM, "-dumpversion"], capture_output=True, text=True, check=True).stdout
    of_the_page = version.startswith("12.")
    rows = {"sensor_nonlinearity": "sensor curve", "play_hysteresis": "play, leak, sensor lag"}
    for names in (["sensor_nonlinearity"], ["gas_compression"], CHAIN):
        folder = tmp_path / names[0]
        write_files(export_files(extended_calibration(chain_of(names, 1)), "c", fixed="q31"), folder)
        for core, flags in CORES.items():
            out = compiled([folder / "smartshoe_filter.c"], folder / "filter.o", *flags, "-Os", "-c", compiler=ARM)
            size = [ARM.replace("gcc", "size"), str(out)]
            text = subprocess.run(size, capture_output=True, text=True, check=True).stdout
            code, data, zeroed = (int(word) for word in text.splitlines()[1].split()[:3])
            print(f"{core} {' '.join(names)}: {code} bytes of flash, {data + zeroed} bytes of RAM")
            assert data + zeroed == 0
            assert code < 8192
            if of_the_page and names[0] in rows:
                assert [code] == stated(rows[names[0]], {"Cortex-M0+": 2, "Cortex-M4": 4}[core])


@pytest.fixture(scope="module")
def arithmetic(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., int]:
    """A function of the exported arithmetic by name: counts in, a count out."""
    folder = tmp_path_factory.mktemp("arithmetic")
    names = ["times_q", "over_q", "sqrt_q", "exp_q", "log_q", "pow_q", "tanh_q", "expm1_q", "log1p_q"]
    text = functions_text({*names}, FRACTION).replace("static int64_t", "int64_t")
    declared = "\n".join(line + ";" for line in text.splitlines() if line.startswith("int64_t "))
    (folder / "q.c").write_text(f"#include <stdint.h>\n\n{declared}\n\n{text}\n")
    library = ctypes.CDLL(str(compiled([folder / "q.c"], folder / "q.so", "-shared", "-fPIC")))

    def call(name: str, *counts: int) -> int:
        function = getattr(library, name)
        function.restype = ctypes.c_int64
        return int(function(*map(ctypes.c_int64, counts)))

    return call


counts = st.one_of(
    st.integers(-MOST, MOST), st.integers(-(2**49), 2**49), st.integers(-(2**40), 2**40), st.integers(-9, 9)
)


@needs_compiler
@given(a=counts, b=counts)
@settings(max_examples=150, deadline=None)
def test_products_quotients_and_roots_are_right_to_a_count(arithmetic: Callable[..., int], a: int, b: int) -> None:
    def held(value: Fraction) -> Fraction:
        return max(min(value, Fraction(MOST)), Fraction(-MOST))

    assert abs(arithmetic("times_q", a, b) - held(Fraction(a * b, 2**FRACTION))) <= 0.51
    if b:
        assert abs(arithmetic("over_q", a, b) - held(Fraction(a * 2**FRACTION, b))) <= 0.5
    assert arithmetic("sqrt_q", a) == math.isqrt(max(a, 0) * 2**FRACTION)


@needs_compiler
@given(a=counts, b=counts)
@settings(max_examples=150, deadline=None)
def test_functions_are_those_of_the_library(arithmetic: Callable[..., int], a: int, b: int) -> None:
    unit, largest = 2.0**-FRACTION, MOST * 2.0**-FRACTION
    x, y = a * unit, b * unit

    def power(exponent: float) -> float:
        return min(math.exp(min(exponent, 50.0)), largest)

    def real(name: str, *arguments: int) -> float:
        return arithmetic(name, *arguments) * unit

    assert real("exp_q", a) == pytest.approx(power(x), rel=1e-12, abs=4 * unit)
    assert real("expm1_q", a) == pytest.approx(power(x) - 1.0, rel=1e-12, abs=4 * unit)
    assert real("tanh_q", a) == pytest.approx(math.tanh(x), abs=8 * unit)
    if a > 0:
        assert real("log_q", a) == pytest.approx(math.log(x), abs=64 * unit)
        assert real("log1p_q", a) == pytest.approx(math.log(min(x + 1.0, largest)), abs=64 * unit)
    if 2**30 < a < 2**50 and abs(b) < 2**48:
        assert real("pow_q", a, b) == pytest.approx(power(y * math.log(x)), rel=1e-11, abs=4 * unit)


@pytest.mark.parametrize(
    ("body", "says"),
    [
        ("x = erf(x);", "erf"),
        ("x = x @ 2.0;", "no C"),
        ("do { x = 0.5 * x; } while (x > 1.0);", "expected"),
        ("x = 0.5 *", "ends"),
    ],
)
def test_c_that_has_no_integer_form_is_refused(body: str, says: str, monkeypatch: pytest.MonkeyPatch) -> None:
    model = chain_of(["sensor_lag"], 1)
    monkeypatch.setattr(type(model.parts[0].effect.inverse(model.parts[0].values, 0.01)), "c_step",
                        lambda self, name: CStep({}, body))  # fmt: skip
    with pytest.raises(UsageError, match=f"block sensor_lag .*{says}.*--precision double"):
        export_files(extended_calibration(model), "c", fixed="q31")


def test_sixteen_bits_are_refused_where_half_a_step_moves_the_force_too_far() -> None:
    asymmetry = effect("load_unload_asymmetry")
    # 17 % of the gain lost on the way down: a step of the reading decides which way it goes.
    with pytest.raises(UsageError, match=r"q15 cannot hold .* up to \d.* N: use --fixed q31"):
        export_files(extended_calibration(BASELINE.with_part(asymmetry, np.array([0.168, 0.005]))), "c", fixed="q15")
