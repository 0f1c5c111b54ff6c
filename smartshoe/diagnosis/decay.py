"""A reading that falls while no load is logged, or while the load is still: how fast, and by which law.

No cause can be named: a leak, a relaxing wall and a load that is removed look alike. What can be given is the time
constant, how much is lost, and whether one exponential describes it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from smartshoe.arrays import Array
from smartshoe.display import duration
from smartshoe.integrity.thresholds import Thresholds, decided_by, largest_of_noise
from smartshoe.recording import Recording
from smartshoe.signals.noise import NORMAL_95, white_noise_sd

Course = Literal["exponential", "slower", "faster", "undecided"]


@dataclass(frozen=True, slots=True)
class Decay:
    """The result of `decay_of`.

    From ``onset_s`` (since the first sample) the reading falls by ``lost_percent`` of its first level in ``within_s``,
    with the time constant ``tau_s`` of one exponential (``ci95_s``), towards ``plateau`` (in the reading's unit; 0
    unless the data shows another). ``from_start_s`` is the time constant with the stretch before the onset included,
    except for a first rise. ``order`` m (``order_ci95``): the rate of fall goes with the m-th power of the reading, -p'
    = k p^m. 1 is exponential, 1/2 an orifice with incompressible flow, up to 2 a narrow channel with gas far above
    ambient pressure; None where too little is lost. ``course`` is the verdict on it, ``says`` all of it in a sentence.
    """

    onset_s: float
    tau_s: float
    ci95_s: tuple[float, float]
    from_start_s: float
    lost_percent: float
    within_s: float
    plateau: float
    order: float | None
    order_ci95: tuple[float, float] | None
    course: Course
    says: str


def decay_of(recording: Recording, thresholds: Thresholds | None = None) -> Decay | None:
    """The decay of the first sensor's reading; None if the load moves, or the reading does not fall steadily."""
    thresholds = decided_by(thresholds)
    standing = _load_stands_still(recording, thresholds.standing)
    if standing is None or not recording.sensors:
        return None
    sensor = recording.sensors[0]
    present = sensor.present
    if present.sum() < thresholds.least_samples:
        return None
    points = max(thresholds.bins // 8, thresholds.least_samples)  # a smooth fall needs few points
    time_s, reading, sign = _thinned(recording.time_s[present] - recording.time_s[0], sensor.values[present], points)
    noise = largest_of_noise(reading.size, thresholds) * white_noise_sd(reading)
    end = max(time_s.size // 20, 3)
    low = float(np.median(reading[-end:]))
    full = _first_at_its_level(reading, low, thresholds.standing, noise)
    time_s, reading = time_s[full:], reading[full:]
    high = float(np.median(reading[:3]))
    if high <= 0.0 or not _falls(reading, thresholds):
        return None
    slight = thresholds.clear * thresholds.standing
    begun = np.flatnonzero(reading < high - max(thresholds.standing * (high - low), noise))
    # A decay of which little is seen is a straight line, without a corner at its start.
    first = max(int(begun[0]) - 1, 0) if begun.size and high - low > slight * high else 0
    if time_s.size - first < thresholds.local // 4:
        return None
    onset_s, t, v = float(time_s[first]), time_s[first:] - time_s[first], reading[first:]
    lost = (high - low) / high
    guess = _guess(t, v, high)
    one = _fit(_exponential, t, v, [high, guess])
    plateau = 0.0
    order: float | None = None
    order_ci95: tuple[float, float] | None = None
    course: Course = "undecided"
    if lost > slight:
        towards = _fit(_to_plateau, t, v, [high - low, _guess(t, v - low, high - low), low])
        ordered = _fit(_of_order, t, v, [high, float(one.at[1]), 1.05])
        earned = towards.square < min(one.square / thresholds.clear, ordered.square)
        if earned and towards.at[2] > slight * high:
            one, plateau = towards, sign * float(towards.at[2])
            ordered = _fit(_of_order, t, v - one.at[2], [high - float(one.at[2]), float(one.at[1]), 1.05])
        half = NORMAL_95 * float(ordered.sd[2])
        if half < thresholds.same:  # else too little of the curve is seen to tell its law
            order = float(ordered.at[2])
            order_ci95 = (order - half, order + half)
            apart = abs(order - 1.0) > max(half, slight)
            course = ("slower" if order > 1.0 else "faster") if apart else "exponential"
    tau_s, tau_sd = float(one.at[1]), float(one.sd[1])
    from_start_s = float(_fit(_exponential, time_s, reading, [high, tau_s]).at[1]) if first else tau_s
    ci95_s = (max(tau_s - NORMAL_95 * tau_sd, 0.0), tau_s + NORMAL_95 * tau_sd)
    unit = sensor.unit.symbol
    begins = f" from {onset_s:.3g} s on" if onset_s > thresholds.standing * float(time_s[-1]) else ""
    since = f"{time_s[0]:.3g} s on" if full else "the first sample"
    counted = f" ({_duration(from_start_s)} when counted from {since})" if begins and first and lost > 0.5 else ""
    aim = f" towards {plateau:.3g} {unit}" if plateau else ""
    says = (
        f"the {sensor.name} falls by {100 * lost:.3g} % in {float(t[-1]):.3g} s{begins}{aim}, with a time constant of"
        f" {_duration(tau_s)}{counted}, {_course_says(course, order)}: a leak or a relaxation;"
        f" {'only a logged load' if standing == 'absent' else 'no load that stands still'} can tell which"
    )
    return Decay(
        onset_s, tau_s, ci95_s, from_start_s, 100.0 * lost, float(t[-1]), plateau, order, order_ci95, course, says
    )


def _load_stands_still(recording: Recording, standing: float) -> Literal["absent", "still"] | None:
    """Whether the load is "absent" or "still", within ``standing`` of its size; None where it moves."""
    loads = recording.of_role("load")
    if not loads:
        return "absent"
    values = loads[0].values[loads[0].present]
    if not values.size:
        return "absent"
    low, high = (float(value) for value in np.percentile(values, [1, 99]))
    return "still" if high - low <= standing * max(abs(low), abs(high)) else None


def _thinned(time_s: Array, values: Array, points: int) -> tuple[Array, Array, float]:
    """Block means of time and values, at most ``points``, and the sign -1.0 where a negative reading was reversed."""
    width = -(-values.size // points)
    count = values.size // max(width, 1)
    if count == 0:
        return time_s, values, 1.0
    t = time_s[: count * width].reshape(count, width).mean(axis=1)
    v = values[: count * width].reshape(count, width).mean(axis=1)
    sign = -1.0 if v[: max(count // 10, 1)].mean() < 0 else 1.0
    return t, sign * v, sign


def _first_at_its_level(reading: Array, low: float, standing: float, noise: float) -> int:
    """The index from which a reading that ends at ``low`` has reached its highest level: a unit may first be filled."""
    medians = np.median(np.lib.stride_tricks.sliding_window_view(reading[: max(reading.size // 10, 3)], 3), axis=1)
    top = int(np.argmax(medians))
    below = np.flatnonzero(reading[: top + 2] < medians[top] - max(standing * (medians[top] - low), noise))
    return int(below[-1]) + 1 if below.size else 0


def _falls(reading: Array, thresholds: Thresholds) -> bool:
    """Whether the reading falls from a positive level, by more than its noise, and hardly ever rises."""
    tenth = reading.size // 10
    first, last = reading[:tenth], reading[-tenth:]
    fall = float(np.median(first) - np.median(last))
    if fall <= max(
        largest_of_noise(reading.size, thresholds) * white_noise_sd(reading) / np.sqrt(tenth),
        thresholds.material * abs(float(np.median(first))),
    ):
        return False
    means = np.array([float(np.median(part)) for part in np.array_split(reading, 12)])
    steps = np.diff(means)
    moved = float(np.abs(steps).sum())
    return (
        float(np.median(first)) > 0.0
        and moved > 0.0
        and float(-steps[steps < 0].sum()) >= (1.0 - thresholds.same) * moved
    )


def _guess(t: Array, v: Array, high: float) -> float:
    """Time constant from a line through the logarithm of the first part, above a fifth of ``high``."""
    part = v > 0.2 * high
    part[:3] = True
    slope = float(np.polyfit(t[part], np.log(np.maximum(v[part], 1e-9 * high)), 1)[0])
    return float(np.clip(-1.0 / slope if slope < 0 else 1e3 * t[-1], 1e-3 * t[-1], 1e6 * t[-1]))


@dataclass(frozen=True, slots=True)
class _Fitted:
    """Parameters ``at`` the optimum, their standard deviations, and the sum of squares."""

    at: Array
    sd: Array
    square: float


def _fit(model: Callable[[Array, Array], Array], t: Array, v: Array, start: list[float]) -> _Fitted:
    """Least squares; the standard deviations allow for correlated residuals."""
    from scipy.optimize import least_squares

    begin = np.array(start, dtype=float)

    def error(at: Array) -> Array:
        return model(at, t) - v

    found = least_squares(error, begin, x_scale=np.maximum(np.abs(begin), 1e-3), max_nfev=200)
    residual = np.asarray(found.fun, dtype=float)
    square = float(residual @ residual)
    alike = float(np.clip(residual[1:] @ residual[:-1] / square, 0.0, 0.99)) if square > 0 else 0.0
    variance = square * (1.0 + alike) / (1.0 - alike) / max(residual.size - begin.size, 1)
    jac = np.asarray(found.jac, dtype=float)
    scale = np.linalg.norm(jac, axis=0)
    scale[scale == 0.0] = 1.0
    # For nearly collinear columns the inverse of their products may have a negative diagonal; a pseudo-inverse of the
    # columns has not.
    root = np.linalg.pinv(jac / scale)
    sd = np.linalg.norm(root, axis=1) / scale * np.sqrt(variance)
    return _Fitted(np.asarray(found.x, dtype=float), sd, square)


def _exponential(at: Array, t: Array) -> Array:
    """``at`` holds the initial value and the time constant."""
    return np.asarray(at[0] * np.exp(-t / max(at[1], 1e-9)))


def _to_plateau(at: Array, t: Array) -> Array:
    """An exponential towards the third value of ``at``."""
    return _exponential(at[:2], t) + float(at[2])


def _of_order(at: Array, t: Array) -> Array:
    """The solution of -v' = (v0/tau) (v/v0)^m: v0 (1 + (m - 1) t/tau)^(-1/(m - 1)); ``at`` holds v0, tau and m."""
    over = float(at[2]) - 1.0
    if abs(over) < 1e-6:
        return _exponential(at[:2], t)
    base = np.maximum(1.0 + over * t / max(at[1], 1e-9), 1e-12)
    return np.asarray(at[0] * np.exp(-np.log(base) / over))


def _duration(time_s: float) -> str:
    """A time in words; one of hours is known to two digits at best."""
    return duration(time_s, 600.0, 2)


def _course_says(course: Course, order: float | None) -> str:
    """The law of the decay in words."""
    if course == "undecided" or order is None:
        return "if it goes on to zero (too little of the fall is seen to show its law)"
    if course == "exponential":
        return "as one exponential"
    return f"{course} than exponentially (its rate is proportional to the reading to the power {order:.2f})"
