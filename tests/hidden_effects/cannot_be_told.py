"""What cannot be told apart: the catalogue's plain equations, fitted to an effect alone and without noise.

For each hidden effect of the unit (not for noise and faults of data) the fitted recordings are made again with that
effect alone and without noise. What a refitted baseline leaves of them is the effect's size here; what the plain
equation of each effect of docs/effects.md leaves beside the baseline, its shapes on a small grid, its strength and the
baseline free, says which of them would do as well. The equations are written anew here, linear in their strength, from
that table; a diagnosis whose blocks have more freedom leaves less.

``departure`` is what the effect's own plain equation leaves, as a share of its size. ``cannot_be_told_from`` are the
effects whose plain equation leaves hardly more than the effect's own: 1.15 times and 0.02 % of full scale; without a
displacement also static curves within 1.6 times and 0.05 %. That noise hides a difference is not counted.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar, nnls

from simulators.effects.memory import follow
from simulators.hidden._baseline import lagged
from simulators.hidden.cases import BankCase
from simulators.hidden.effects.operators import cycles_done, slip
from simulators.instruments.presets import FULL_SCALE_N
from smartshoe.recording import Recording

Array = NDArray[np.float64]
Columns = list[Array]

STEP_S = 0.01  # or the recording's own, where that is longer
MOST = 6000  # samples that a fit looks at
POLES = np.geomspace(0.01, 30.0, 15)  # 1/s
SLOPE = 1.05
# Where the pole is refitted with each equation: by the baseline's own, and elsewhere, as an effect drags that along.
BESIDE = (0.6, 1.0, 1.6)
ELSEWHERE = (0.05, 0.15, 0.5, 2.0)  # 1/s
NEAR, HARDLY_PERCENT = 1.15, 0.02
CURVE_NEAR, CURVE_PERCENT = 1.6, 0.05
CURVES = ("gas_compression", "wall_hardening", "contact_area", "sensor_nonlinearity")
RADII = np.array([0.01, 0.02, 0.04, 0.08, 0.16, 0.3])


@dataclass(frozen=True, eq=False)
class Course:
    """One recording on an even grid, shares of full scale: load, reading, time, the baseline's own reading."""

    f: Array
    y: Array
    t: Array
    step_s: float
    around: dict[str, Array]
    solid: Callable[[Array], Array]

    def lag(self, signal: Array, time_constant_s: float) -> Array:
        return lagged(signal, self.step_s, 1.0 / time_constant_s)

    def integral(self, signal: Array) -> Array:
        return np.cumsum(signal) * self.step_s


# Each yields alternatives: columns that add to the reading, and whether their weights are not below zero.
Plain = Callable[[Course], Iterator[tuple[Columns, bool]]]


def second_relaxation(c: Course) -> Iterator[tuple[Columns, bool]]:
    for tau_s in np.geomspace(0.05, 150.0, 11):
        yield [c.lag(c.f, float(tau_s))], True


def power_law_creep(c: Course) -> Iterator[tuple[Columns, bool]]:
    times_s = np.geomspace(0.02, 2000.0, 11)
    for power in (0.05, 0.15, 0.3, 0.45, 0.65):
        yield [sum(tau**-power * (c.lag(c.f, float(tau)) - c.f) for tau in times_s)], True  # type: ignore[list-item]


def linear_leak(c: Course) -> Iterator[tuple[Columns, bool]]:
    yield [-c.integral(c.y)], True


def orifice_leak(c: Course) -> Iterator[tuple[Columns, bool]]:
    yield [-c.integral(np.sign(c.y) * np.sqrt(np.abs(c.y)))], True


def gas_heat(c: Course) -> Iterator[tuple[Columns, bool]]:
    for tau_s in np.geomspace(0.08, 6.0, 8):
        yield [c.f - c.lag(c.f, float(tau_s))], True


def gas_compression(c: Course) -> Iterator[tuple[Columns, bool]]:
    yield [c.y**2], True


def wall_hardening(c: Course) -> Iterator[tuple[Columns, bool]]:
    for beta in (0.0, 0.4, 1.5):
        yield [-c.solid(c.f**3 / (1.0 + beta * c.f**2))], True


def contact_area(c: Course) -> Iterator[tuple[Columns, bool]]:
    for a in (0.05, 0.5, 2.0):
        yield [-c.solid(c.f**2 / (1.0 + a * np.maximum(c.f, 0.0)))], True


def sensor_nonlinearity(c: Course) -> Iterator[tuple[Columns, bool]]:
    yield [c.y**2, c.y**3], False


def dead_band(c: Course) -> Iterator[tuple[Columns, bool]]:
    for gap in (0.01, 0.02, 0.04, 0.08, 0.16):
        for width in (0.1, 0.3, 0.7):
            w = width * gap
            soft = w * (np.logaddexp(0.0, (c.f - gap) / w) - np.logaddexp(0.0, -gap / w))
            yield [c.solid(soft - c.f)], True


def play_hysteresis(c: Course) -> Iterator[tuple[Columns, bool]]:
    out = []
    for radius in RADII:
        z = np.empty(c.f.size)
        slip(c.f, np.array([radius]), np.array([radius]), np.array([1.0 / radius]), z)
        out.append(-c.solid(z))
    yield out, True


def bouc_wen_hysteresis(c: Course) -> Iterator[tuple[Columns, bool]]:
    for width in (0.02, 0.05, 0.12, 0.25):
        z = np.empty(c.f.size)
        follow(np.diff(c.f, prepend=c.f[0]), np.full(c.f.size, width), 0.0, z)  # power 1, gamma and beta a half
        yield [-c.solid(z)], True
        yield [-c.solid(np.sign(z) * np.abs(z) ** 0.6)], True


def load_unload_asymmetry(c: Course) -> Iterator[tuple[Columns, bool]]:
    for turn in (0.001, 0.005, 0.02):
        sense = np.empty(c.f.size)
        follow(np.diff(c.f, prepend=c.f[0]), np.full(c.f.size, turn), 1.0, sense)
        yield [-c.solid(c.f * 0.5 * (1.0 - sense))], False


def rate_gain(c: Course) -> Iterator[tuple[Columns, bool]]:
    yield [c.solid(c.f * np.abs(np.gradient(c.f, c.step_s)))], False


def mullins_softening(c: Course) -> Iterator[tuple[Columns, bool]]:
    most = np.maximum.accumulate(np.maximum(c.f, 0.0))
    yield [c.solid(c.f * most)], True
    for width in (0.1, 0.5):
        yield [c.solid(c.f * np.tanh((most**2 - c.f**2) / width))], True


def cycle_conditioning(c: Course) -> Iterator[tuple[Columns, bool]]:
    done = np.empty(c.f.size)
    cycles_done(c.f, 0.1, 0.03, done)
    for cycles in (1.0, 2.5, 6.0, 15.0):
        yield [c.solid(c.f * -np.expm1(-done / cycles))], False


def gain_drift(c: Course) -> Iterator[tuple[Columns, bool]]:
    yield [c.y * c.t / 300.0, *(c.y * warmer for warmer in _warmer(c))], False


def sensor_lag(c: Course) -> Iterator[tuple[Columns, bool]]:
    whole = c.solid(c.f)
    for tau_s in (0.004, 0.01, 0.025, 0.06, 0.15, 0.4):
        yield [c.lag(whole, tau_s) - whole], True


def delay(c: Course) -> Iterator[tuple[Columns, bool]]:
    whole = c.solid(c.f)
    for late_s in (-0.03, -0.005, 0.005, 0.02, 0.06, 0.15):
        yield [np.interp(c.t - late_s, c.t, whole) - whole], False


def clock_drift(c: Course) -> Iterator[tuple[Columns, bool]]:
    whole = c.solid(c.f)
    for skew in (-2e-3, -2e-4, 2e-4, 2e-3):
        yield [np.interp(c.t * (1.0 - skew), c.t, whole) - whole], True


def zero_drift(c: Course) -> Iterator[tuple[Columns, bool]]:
    yield [c.t / 300.0, *_warmer(c)], False


def warm_up(c: Course) -> Iterator[tuple[Columns, bool]]:
    for tau_s in (8.0, 16.0, 32.0, 64.0, 120.0):
        yield [-np.expm1(-c.t / tau_s)], False


def permanent_set(c: Course) -> Iterator[tuple[Columns, bool]]:
    yield [c.integral(np.maximum(c.f, 0.0))], True


def saturation(c: Course) -> Iterator[tuple[Columns, bool]]:
    whole = c.solid(c.f)
    for level in np.linspace(0.5, 0.98, 9):
        yield [-np.maximum(whole - level, 0.0)], True


def cross_talk(c: Course) -> Iterator[tuple[Columns, bool]]:
    if "neighbour" in c.around:
        yield [c.around["neighbour"]], False


def _warmer(c: Course) -> Columns:
    return [c.around["temperature"] - c.around["temperature"][0]] if "temperature" in c.around else []


PLAIN: dict[str, Plain] = {
    f.__name__: f
    for f in (
        second_relaxation, power_law_creep, linear_leak, orifice_leak, gas_heat, gas_compression, wall_hardening,
        contact_area, sensor_nonlinearity, dead_band, play_hysteresis, bouc_wen_hysteresis, load_unload_asymmetry,
        rate_gain, mullins_softening, cycle_conditioning, gain_drift, sensor_lag, delay, clock_drift, zero_drift,
        warm_up, permanent_set, saturation, cross_talk,
    )
}  # fmt: skip


def with_what_cannot_be_told(case: BankCase) -> dict[str, Any]:
    """The case's truth with ``departure`` and ``cannot_be_told_from`` of each effect."""
    truth = case.truth
    displaced = any("displacement" in recording.channels for recording in case.recordings)
    for number, effect in enumerate(truth["effects"]):
        effect["departure"] = None
        if effect["id"] not in PLAIN:
            continue
        size, left = leaves(case.alone(number), case.subject.full_scale_mbar)
        own = left[effect["id"]]
        effect["departure"] = round(own / size, 4) if size > 0 else None
        effect["cannot_be_told_from"] = sorted(
            rival
            for rival, rest in left.items()
            if rival != effect["id"] and _is_near(effect["id"], rival, own, rest, displaced)
        )
    return truth


def _is_near(name: str, rival: str, own: float, rest: float, displaced: bool) -> bool:
    if rest <= NEAR * own + HARDLY_PERCENT:
        return True
    return name in CURVES and rival in CURVES and not displaced and rest <= CURVE_NEAR * own + CURVE_PERCENT


def leaves(
    recordings: tuple[Recording, ...], full_scale_mbar: float, names: Iterable[str] = PLAIN
) -> tuple[float, dict[str, float]]:
    """What the baseline leaves of ``recordings``, and with the plain equation of each of ``names``, % of full scale."""
    grids = [_grid(recording, full_scale_mbar) for recording in recordings]
    thin = max(1, sum(f.size for f, *_ in grids) // MOST)

    def cat(parts: list[Array]) -> Array:
        return np.concatenate([part[::thin] for part in parts])

    y = cat([grid[1] for grid in grids])

    def base(pole: float) -> Array:
        columns = [cat([f for f, *_ in grids]), cat([lagged(f, h, pole) for f, _, _, h, _ in grids]), np.ones(y.size)]
        return np.column_stack(columns)

    size, pole, weights = _refitted(base, y)
    # With the slope by the pole, so that it is refitted with each equation.
    poles = [*(pole * k for k in BESIDE), *ELSEWHERE]
    bases = [np.linalg.qr(np.column_stack([base(k), base(k * SLOPE)[:, 1]]))[0] for k in poles]
    rests = [y - basis @ (basis.T @ y) for basis in bases]
    at_once, later = weights[0] / weights[:2].sum(), weights[1] / weights[:2].sum()
    courses = [Course(f, reading, t, h, around, _solid(at_once, later, pole, h)) for f, reading, t, h, around in grids]
    left = {}
    for name in names:
        best = size
        for alternatives in zip(*(PLAIN[name](course) for course in courses), strict=True):
            signed = alternatives[0][1]
            together = np.column_stack([cat(list(parts)) for parts in zip(*(a[0] for a in alternatives), strict=True)])
            for basis, rest in zip(bases, rests, strict=True):
                best = min(best, _rest_of(together - basis @ (basis.T @ together), rest, signed))
        left[name] = 100.0 * best
    return 100.0 * size, left


def _refitted(base: Callable[[float], Array], y: Array) -> tuple[float, float, Array]:
    """The baseline's rms, pole and weights: the best of a grid, then refined."""
    found = [_fit(base(float(pole)), y, float(pole)) for pole in POLES]
    best = int(np.argmin([one[0] for one in found]))
    low, high = POLES[max(best - 1, 0)], POLES[min(best + 1, POLES.size - 1)]
    refined = minimize_scalar(
        lambda log_pole: _fit(base(float(np.exp(log_pole))), y, 0.0)[0],
        bounds=(np.log(low), np.log(high)), method="bounded", options={"xatol": 1e-4},
    )  # fmt: skip
    pole = float(np.exp(refined.x))
    return min(found[best], _fit(base(pole), y, pole), key=lambda one: one[0])


def _solid(at_once: float, later: float, pole: float, step_s: float) -> Callable[[Array], Array]:
    return lambda signal: at_once * signal + later * lagged(signal, step_s, pole)


def _fit(columns: Array, y: Array, pole: float) -> tuple[float, float, Array]:
    weights = np.linalg.lstsq(columns, y, rcond=None)[0]
    if weights[1] < 0:  # an arm is passive
        weights = np.insert(np.linalg.lstsq(columns[:, [0, 2]], y, rcond=None)[0], 1, 0.0)
    return float(np.sqrt(np.mean((y - columns @ weights) ** 2))), pole, weights


def _rest_of(columns: Array, rest: Array, signed: bool) -> float:
    scale = np.sqrt(np.sum(columns**2, axis=0)) + 1e-300
    columns = columns / scale
    gram, right = columns.T @ columns + 1e-9 * np.eye(columns.shape[1]), columns.T @ rest
    weights = nnls(gram, right)[0] if signed else np.linalg.solve(gram, right)
    return float(np.sqrt(np.mean((rest - columns @ weights) ** 2)))


def _grid(recording: Recording, full_scale_mbar: float) -> tuple[Array, Array, Array, float, dict[str, Array]]:
    step_s = max(STEP_S, recording.sample_time_s)
    t = np.arange(0.0, recording.time_s[-1] + 1e-9, step_s)

    def at(values: Array) -> Array:
        return np.interp(t, recording.time_s, values)

    around = {name: at(recording[name].values) for name in ("temperature", "neighbour") if name in recording.channels}
    if "neighbour" in around:
        around["neighbour"] = around["neighbour"] / full_scale_mbar
    return at(recording.force_n) / FULL_SCALE_N, at(recording["pressure"].values) / full_scale_mbar, t, step_s, around
