"""Spectral lines: hum at any frequency, its own or folded, looked for where the load rests."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.display import percent
from smartshoe.integrity._fault import Finding
from smartshoe.integrity._view import View, toggling
from smartshoe.integrity.thresholds import Thresholds, largest_of_noise
from smartshoe.signals.masks import runs_of
from smartshoe.signals.noise import MAINS_HZ, robust_sd

HARMONICS = 3  # that a line is called by: half and twice as many changed no finding


def hum(view: View, bad: Mask) -> Iterator[Finding]:
    """Kind ``hum``: one finding for all lines; nothing is masked, since every sample has it."""
    found = spectral_lines(view, bad)
    if not found:
        return
    rate_hz = 1.0 / view.step_s
    parts = []
    for frequency_hz, amplitude in found:
        folded = aliases(frequency_hz, rate_hz, float(view.time_s[-1] - view.time_s[0]))
        origin = f" ({' or '.join(folded)})" if folded else ""
        parts.append(f"{frequency_hz:.4g} Hz{origin} with {percent(amplitude / view.span)}")
    yield Finding(
        "hum",
        np.ones(len(view.recording), dtype=bool),
        f"a hum stands in the reading also while the load rests: at {', at '.join(parts)} of its span; another"
        " sampling rate would tell a folded line from a true one",
    )


def aliases(frequency_hz: float, rate_hz: float, duration_s: float) -> list[str]:
    """Harmonics of 50 and 60 Hz that appear at ``frequency_hz`` when sampled at ``rate_hz``."""
    near = 0.05 + 2.0 / duration_s
    names = []
    for mains in MAINS_HZ:
        for harmonic in range(1, HARMONICS + 1):
            true = harmonic * mains
            folded = abs(true - rate_hz * np.rint(true / rate_hz))
            if abs(folded - frequency_hz) <= near + 0.001 * true:
                names.append(f"{true:g} Hz mains" if harmonic == 1 else f"{true:g} Hz, {harmonic} x {mains:g} Hz")
                break
    return names


def spectral_lines(view: View, bad: Mask) -> list[tuple[float, float]]:
    """Frequency in Hz and amplitude (of the reading) of each spectral line, the strongest first.

    What lies beside a stronger one by less than a window over the longest rest resolves is that line, which wanders.
    """
    if view.span == 0.0:
        return []
    stretches = _quiet_stretches(view)
    size = sum(last - first for first, last in stretches)
    if size < 128:
        return []
    residual, weight = _residual(view, bad, stretches)
    longest = max(last - first for first, last in stretches)
    resolved_hz = view.thresholds.clear / (longest * view.step_s)  # half the main lobe of a Hann window
    found: list[tuple[float, float]] = []
    for _ in range(view.thresholds.few):
        line = _strongest(view, residual, weight, stretches)
        if line is None:
            break
        if all(abs(line[0] - frequency_hz) > resolved_hz for frequency_hz, _ in found):
            found.append(line[:2])
        residual = residual - weight * line[2]
    return found


def _quiet_stretches(view: View) -> list[tuple[int, int]]:
    """Stretches (first, past last) of a few blocks and more in which the block means of the load stand still."""
    n, given = view.load.values.size, view.thresholds
    block = max(given.few, round(given.clear * given.echo_s / view.step_s))
    count = n // block
    if count < 4:
        return []
    blocks = view.load.values[: count * block].reshape(count, block)
    mean = blocks.mean(axis=1)
    noise = view.load.quiet_noise
    moves = given.still_per_s * view.load_span * block * view.step_s
    still = np.abs(np.diff(mean)) <= max(moves, largest_of_noise(1, given) * np.sqrt(2.0 / block) * noise)
    calm = blocks.std(axis=1) <= moves + given.clear * noise  # a sine of four cycles a second is not
    still &= calm[1:] & calm[:-1]
    gap = np.flatnonzero(view.gap | (view.jump != 0.0)) // block
    still[np.minimum(gap, still.size - 1)] = False
    quiet = np.zeros(count, dtype=bool)
    quiet[1:-1] = still[1:] & still[:-1]
    starts, stops = runs_of(quiet)
    # A block is as long as a sensor's lag: in the first of a stretch the reading may still follow the move before it.
    return [(int(a + 1) * block, int(b) * block) for a, b in zip(starts, stops, strict=True) if b - a > given.few]


def _residual(view: View, bad: Mask, stretches: list[tuple[int, int]]) -> tuple[Array, Array]:
    """Reading less a fifth-degree polynomial in each stretch under a Hann window, 0 elsewhere; and the window (m,)."""
    y = view.reading.values
    limit = view.reading.largest * view.reading.noise + view.thresholds.clear * view.reading.step
    residual, weight = np.zeros(y.size), np.zeros(y.size)
    for first, last in stretches:
        x = np.linspace(-1.0, 1.0, last - first)
        basis = np.polynomial.legendre.legvander(x, 5)
        part, good = y[first:last], ~bad[first:last]
        if good.sum() < view.thresholds.local // 2:
            continue
        seen = basis[good]  # nearly orthogonal: their products do
        left = part - basis @ np.linalg.lstsq(seen.T @ seen, seen.T @ part[good], rcond=None)[0]
        window = np.hanning(last - first) * good
        window *= np.abs(left) <= np.maximum(limit[first:last], view.reading.largest * robust_sd(left))
        residual[first:last], weight[first:last] = left * window, window
    return residual, weight


def _lasts(whole: float, own: Array, weight: Array, noise_power: Array, thresholds: Thresholds) -> bool:
    """Whether one phase and one power hold in all parts.

    A ringing begins anew with each move of the load, larger or smaller, and dies.
    ``whole`` amplitude over all parts, ``own`` (p,) and ``weight`` (p,) of each, first and second half of a stretch in
    turn; ``noise_power`` (p,) of what noise beside the line adds to its square.
    """
    share = weight**2
    power = share * (own**2 - noise_power)
    doubt = largest_of_noise(1, thresholds) * float(np.sqrt(share**2 @ (noise_power**2 + 2.0 * whole**2 * noise_power)))
    coherent = thresholds.clear * whole**2 * float(share.sum()) > float(power.sum()) - doubt
    seen = own[noise_power < (thresholds.same * max(whole, float(np.median(own)))) ** 2]
    if seen.size >= thresholds.few and np.quantile(seen, 0.9) > thresholds.clear * np.quantile(seen, 0.1):
        return False
    return coherent and float(power[0::2].sum()) < thresholds.clear * float(power[1::2].sum()) + doubt


def _strongest(
    view: View, residual: Array, weight: Array, stretches: list[tuple[int, int]]
) -> tuple[float, float, Array] | None:
    """Frequency, amplitude and course (m,) of the strongest line that passes every test, or None."""
    from scipy.fft import next_fast_len, rfft
    from scipy.ndimage import median_filter

    n = residual.size
    size = 2 * int(next_fast_len((n + 1) // 2, real=True))
    power = np.abs(rfft(residual, size)) ** 2
    frequency = np.fft.rfftfreq(size, view.step_s)
    given = view.thresholds
    lowest_hz = given.few / given.hold_s  # below, a line is drift or physics
    first = int(np.searchsorted(frequency, lowest_hz))
    if power.size - first < 64 or not power[first:].any():
        return None
    width = max(1, round(lowest_hz / float(frequency[1])) // 64)
    coarse = power[: power.size // width * width].reshape(-1, width)
    smooth = median_filter(np.median(coarse, axis=1), 65, mode="mirror") / np.log(2.0)
    local = smooth[np.minimum(np.arange(power.size) // width, smooth.size - 1)]
    ratio = power / np.maximum(local, 1e-300)
    ratio[:first] = 0.0
    sure = np.log(n / given.false_alarm)  # noise has an exponential law of power
    best = int(np.argmax(np.where(np.isfinite(ratio), power * (ratio > sure), 0.0)))
    if ratio[best] <= sure:
        return None
    carrier = np.exp(-2j * np.pi * float(frequency[best]) * view.step_s * np.arange(n))
    folded = 2.0 if 0 < best < size // 2 else 1.0
    whole = folded * np.dot(residual, carrier) / weight.sum()
    own, halves = [], np.zeros(2)
    weights, noise_power = [], []
    level = folded**2 * float(local[best]) / float(np.dot(weight, weight))
    for low, high in stretches:
        middle = (low + high) // 2
        for i, (a, b) in enumerate(pairwise((low, middle, high))):
            total = float(weight[a:b].sum())
            if total > 0:
                part = folded * np.dot(residual[a:b], carrier[a:b]) / total
                halves[i] += abs(part) ** 2
                own.append(abs(part))
                weights.append(total)
                noise_power.append(level * float(np.dot(weight[a:b], weight[a:b])) / total**2)
    amplitude = max(abs(whole), float(np.median(own)))
    step, noise = view.reading.step, float(np.median(view.reading.noise[weight > 0.0]))
    # From peak to peak it must be material; the first line of a toggling between two levels has 2/pi of a step.
    least = max(0.5 * given.material * view.span, 2.0 / np.pi * step if noise < toggling(given) * step else 0.0)
    steady = halves[0] < given.clear**2 * halves[1]  # first halves of the stretches against second ones: ringing dies
    if amplitude < least or not steady or given.clear**2 * abs(whole) < amplitude:  # mains wander a little
        return None
    from_mains = aliases(float(frequency[best]), 1.0 / view.step_s, float(n * view.step_s))
    if not from_mains and not _lasts(abs(whole), np.array(own), np.array(weights), np.array(noise_power), given):
        return None
    course: Array = np.real(whole * np.conj(carrier))
    return float(frequency[best]), float(amplitude), course
