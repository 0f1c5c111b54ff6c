"""Hum: spectral lines in the reading at any frequency, true or folded by sampling, looked for where the load rests.

A slow polynomial is taken off the reading in each segment of rest. A line is a peak of the spectrum that noise would
not reach. It must be of one phase, and last: a ringing begins anew with each move of the load and dies.
"""

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

HARMONICS = 3  # of the mains that a line is named by: half and twice as many changed no finding


def hum(view: View, bad: Mask) -> Iterator[Finding]:
    """Kind ``hum``: one finding for all lines. None is masked, since every sample has the hum."""
    found = spectral_lines(view, bad)
    if not found:
        return
    rate_hz = 1.0 / view.step_s
    named = []
    for frequency_hz, amplitude in found:
        folded = aliases(frequency_hz, rate_hz, float(view.time_s[-1] - view.time_s[0]))
        origin = f" ({' or '.join(folded)})" if folded else ""
        named.append(f"{frequency_hz:.4g} Hz{origin} with an amplitude of {percent(amplitude / view.span)}")
    yield Finding(
        "hum",
        np.ones(len(view.recording), dtype=bool),
        f"the reading has a hum also while the load rests: at {', at '.join(named)} of its span; a recording at another"
        " sampling rate would tell a true frequency from an alias",
        lines_hz=tuple(frequency_hz for frequency_hz, _ in found),
    )


def aliases(frequency_hz: float, rate_hz: float, duration_s: float) -> list[str]:
    """The names of the harmonics of 50 and 60 Hz that appear at ``frequency_hz`` when sampled at ``rate_hz``."""
    resolution_hz = 0.05 + 2.0 / duration_s
    names = []
    for mains_hz in MAINS_HZ:
        for harmonic in range(1, HARMONICS + 1):
            true_hz = harmonic * mains_hz
            folded_hz = abs(true_hz - rate_hz * np.rint(true_hz / rate_hz))
            if abs(folded_hz - frequency_hz) <= resolution_hz + 0.001 * true_hz:
                names.append(
                    f"{true_hz:g} Hz mains" if harmonic == 1 else f"{true_hz:g} Hz, {harmonic} x {mains_hz:g} Hz"
                )
                break
    return names


def spectral_lines(view: View, bad: Mask) -> list[tuple[float, float]]:
    """Frequency in Hz and amplitude (of the reading) of each spectral line, the strongest first.

    A line that lies nearer to a stronger one than a window over the longest rest resolves is the same line, which
    wanders.
    """
    if view.span == 0.0:
        return []
    segments = _quiet_segments(view)
    size = sum(last - first for first, last in segments)
    if size < 128:
        return []
    residual, weight = _residual(view, bad, segments)
    longest = max(last - first for first, last in segments)
    resolved_hz = view.thresholds.clear / (longest * view.step_s)  # half the main lobe of a Hann window
    found: list[tuple[float, float]] = []
    for _ in range(view.thresholds.few):
        line = _strongest(view, residual, weight, segments)
        if line is None:
            break
        if all(abs(line[0] - frequency_hz) > resolved_hz for frequency_hz, _ in found):
            found.append(line[:2])
        residual = residual - weight * line[2]
    return found


def _quiet_segments(view: View) -> list[tuple[int, int]]:
    """Stretches of rest, (first, past last) sample: a few blocks or more in which the load's block means stand still.

    A block is as long as a sensor's lag. The first block of each segment is left out, since the reading may still
    follow the move before it.
    """
    n, given = view.load.values.size, view.thresholds
    block = max(given.few, round(given.clear * given.echo_s / view.step_s))
    count = n // block
    if count < 4:
        return []
    blocks = view.load.values[: count * block].reshape(count, block)
    mean = blocks.mean(axis=1)
    noise = view.load.quiet_noise
    moves = given.still_per_s * view.load_span * block * view.step_s
    is_still = np.abs(np.diff(mean)) <= max(moves, largest_of_noise(1, given) * np.sqrt(2.0 / block) * noise)
    is_calm = blocks.std(axis=1) <= moves + given.clear * noise  # a sine of four cycles a second has equal means
    is_still &= is_calm[1:] & is_calm[:-1]
    gap = np.flatnonzero(view.gap | (view.jump != 0.0)) // block
    is_still[np.minimum(gap, is_still.size - 1)] = False
    is_quiet = np.zeros(count, dtype=bool)
    is_quiet[1:-1] = is_still[1:] & is_still[:-1]
    starts, stops = runs_of(is_quiet)
    return [(int(a + 1) * block, int(b) * block) for a, b in zip(starts, stops, strict=True) if b - a > given.few]


def _residual(view: View, bad: Mask, segments: list[tuple[int, int]]) -> tuple[Array, Array]:
    """(m,) each: the reading less a fifth-degree polynomial in each segment, under a Hann window; and that window.

    Both are 0 elsewhere, and at samples that are ``bad`` (m,) or far off.
    """
    y = view.reading.values
    limit = view.reading.largest * view.reading.noise + view.thresholds.clear * view.reading.step
    residual, weight = np.zeros(y.size), np.zeros(y.size)
    for first, last in segments:
        x = np.linspace(-1.0, 1.0, last - first)
        basis = np.polynomial.legendre.legvander(x, 5)
        reading, is_good = y[first:last], ~bad[first:last]
        if is_good.sum() < view.thresholds.local // 2:
            continue
        rows = basis[is_good]  # nearly orthogonal, so that normal equations serve
        off = reading - basis @ np.linalg.lstsq(rows.T @ rows, rows.T @ reading[is_good], rcond=None)[0]
        window = np.hanning(last - first) * is_good
        window *= np.abs(off) <= np.maximum(limit[first:last], view.reading.largest * robust_sd(off))
        residual[first:last], weight[first:last] = off * window, window
    return residual, weight


def _lasts(whole: float, by_part: Array, weight: Array, noise_power: Array, thresholds: Thresholds) -> bool:
    """Whether a line has one phase and one power in all parts, as a hum has and a ringing has not.

    ``whole``: the line's amplitude over all parts. ``by_part`` (p,): of each part, the first and the second half of a
    segment in turn. ``weight`` (p,): how much each part counts. ``noise_power`` (p,): what noise adds to the square of
    each amplitude.
    """
    share = weight**2
    power = share * (by_part**2 - noise_power)
    doubt = largest_of_noise(1, thresholds) * float(np.sqrt(share**2 @ (noise_power**2 + 2.0 * whole**2 * noise_power)))
    is_coherent = thresholds.clear * whole**2 * float(share.sum()) > float(power.sum()) - doubt
    certain = by_part[noise_power < (thresholds.same * max(whole, float(np.median(by_part)))) ** 2]
    if certain.size >= thresholds.few and np.quantile(certain, 0.9) > thresholds.clear * np.quantile(certain, 0.1):
        return False
    return is_coherent and float(power[0::2].sum()) < thresholds.clear * float(power[1::2].sum()) + doubt


def _strongest(
    view: View, residual: Array, weight: Array, segments: list[tuple[int, int]]
) -> tuple[float, float, Array] | None:
    """Frequency in Hz, amplitude and waveform (m,) of the strongest line that passes every test, or None.

    1. Noise would not reach its power (`_peak_of_spectrum`).
    2. From peak to peak it is material, and larger than the toggling of a silent signal between two levels.
    3. It is as strong in the second halves of the segments as in the first ones, where a ringing has died.
    4. It has one phase over all segments, though mains wander a little.
    5. It lies on a harmonic of the mains, or it lasts (`_lasts`).
    """
    given = view.thresholds
    peak = _peak_of_spectrum(view, residual)
    if peak is None:
        return None
    n = residual.size
    frequency_hz, background, fold = peak
    carrier = np.exp(-2j * np.pi * frequency_hz * view.step_s * np.arange(n))
    whole = fold * np.dot(residual, carrier) / weight.sum()
    by_part, halves = [], np.zeros(2)
    weights, noise_power = [], []
    level = fold**2 * background / float(np.dot(weight, weight))
    for low, high in segments:
        middle = (low + high) // 2
        for i, (a, b) in enumerate(pairwise((low, middle, high))):
            total = float(weight[a:b].sum())
            if total > 0:
                part = fold * np.dot(residual[a:b], carrier[a:b]) / total
                halves[i] += abs(part) ** 2
                by_part.append(abs(part))
                weights.append(total)
                noise_power.append(level * float(np.dot(weight[a:b], weight[a:b])) / total**2)
    amplitude = max(abs(whole), float(np.median(by_part)))
    step, noise = view.reading.step, float(np.median(view.reading.noise[weight > 0.0]))
    # The first harmonic of a toggling between two levels has an amplitude of 2/pi steps.
    least = max(0.5 * given.material * view.span, 2.0 / np.pi * step if noise < toggling(given) * step else 0.0)
    is_steady = halves[0] < given.clear**2 * halves[1]
    if amplitude < least or not is_steady or given.clear**2 * abs(whole) < amplitude:
        return None
    from_mains = aliases(frequency_hz, 1.0 / view.step_s, float(n * view.step_s))
    if not from_mains and not _lasts(abs(whole), np.array(by_part), np.array(weights), np.array(noise_power), given):
        return None
    waveform: Array = np.real(whole * np.conj(carrier))
    return frequency_hz, float(amplitude), waveform


def _peak_of_spectrum(view: View, residual: Array) -> tuple[float, float, float] | None:
    """The strongest peak in the spectrum of a ``residual`` (n,) that noise would not reach, or None.

    Its frequency in Hz, the mean power of the noise around it, and how many sides of the spectrum hold it, 1 or 2.
    """
    from scipy.fft import next_fast_len, rfft
    from scipy.ndimage import median_filter

    n = residual.size
    size = 2 * int(next_fast_len((n + 1) // 2, real=True))
    power = np.abs(rfft(residual, size)) ** 2
    frequency = np.fft.rfftfreq(size, view.step_s)
    given = view.thresholds
    lowest_hz = given.few / given.hold_s  # what is slower may be drift or the unit's physics
    first = int(np.searchsorted(frequency, lowest_hz))
    if power.size - first < 64 or not power[first:].any():
        return None
    width = max(1, round(lowest_hz / float(frequency[1])) // 64)
    coarse = power[: power.size // width * width].reshape(-1, width)
    smooth = median_filter(np.median(coarse, axis=1), 65, mode="mirror") / np.log(2.0)
    background = smooth[np.minimum(np.arange(power.size) // width, smooth.size - 1)]
    ratio = power / np.maximum(background, 1e-300)
    ratio[:first] = 0.0
    limit = np.log(n / given.false_alarm)  # the power of noise has an exponential law
    best = int(np.argmax(np.where(np.isfinite(ratio), power * (ratio > limit), 0.0)))
    if ratio[best] <= limit:
        return None
    return float(frequency[best]), float(background[best]), 2.0 if 0 < best < size // 2 else 1.0
