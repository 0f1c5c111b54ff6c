"""The mains, or another steady tone, in the reading."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from smartshoe.arrays import Array
from smartshoe.display import percent
from smartshoe.models.effects._sensor_evidence import FALSE_ALARMS, LEAST_SAMPLES, NoiseEffect, SensorEvidence
from smartshoe.models.effects._sensor_inverse import Memoryless, c_number
from smartshoe.models.effects.effect import Conditions, EffectParameter, Inverse
from smartshoe.models.effects.exposure import by
from smartshoe.signals.noise import MAINS_HZ

LOWEST_HZ = 2.0  # a slower line may be the load's rhythm or an unknown slow effect
HARMONICS = 7  # of the mains, and of the load's own rhythm
MAINS_TOLERANCE = 2e-3  # of the mains' frequency, and of a logger's clock
NEIGHBOURS = 60  # bins on either side that give the floor
HANN_CORRELATION = 1.944  # neighbouring bins behind a Hann window are worth half as many independent ones
SEGMENTS = 30
STEADY, STEADIER = 0.4, 0.8  # least median over mean of the power of a weak and of a strong tone; noise has 0.69
BURST_SAMPLES = 64
BLOCK_S = 1.0  # blocks in which the load rests or moves
STILL_PER_S = 0.004  # full scales a second: 3 N/s on 800 N
LEAST_BLOCKS = 8
OF_HARMONIC = 0.01  # share of a polynomial's power in one line; without a rhythm of the load a thousandth
QUIETER = 0.25  # of the tone's power under a moving load, that is half its amplitude


@dataclass(frozen=True)
class HumEvidence(SensorEvidence):
    """Evidence of a line at ``frequency_hz`` as logged, with the parts of its amplitude and its ``sources``.

    The tone is ``cosine`` cos(2 pi f t) + ``sine`` sin(2 pi f t), shares of full scale, t from the first sample: the
    parameters of the effect. ``sources``: harmonics of the mains in Hz that this sampling rate puts there.
    """

    frequency_hz: float
    cosine: float
    sine: float
    sources: tuple[float, ...]

    @property
    def lines_hz(self) -> tuple[float, ...]:
        """The one line."""
        return (self.frequency_hz,)


class Hum(NoiseEffect):
    """+ a sinusoid. The mains' 50 Hz lie at the Nyquist frequency of a 100 Hz log, and 60 Hz appear there at 40 Hz."""

    name, family, stage, place = "hum", "noise", "logger", "logger"
    says = "a steady tone runs through the record, loaded or not: a sharp line in the spectrum"
    parameters = (
        EffectParameter("cosine", "FS_reading", "the tone's part in phase with a cosine", 0.0, -0.2, 0.2, 1e-3),
        EffectParameter("sine", "FS_reading", "the tone's part in phase with a sine", 0.0, -0.2, 0.2, 1e-3),
        EffectParameter("frequency", "Hz", "the tone's frequency, before the sampling", None, LOWEST_HZ, 1000.0, 0.01),
    )
    shapes = tuple({"frequency": frequency} for frequency in MAINS_HZ)
    exposed_by = by("rests")
    separated_by = {
        "coloured_noise": by("idle"),
        "spikes": by("repeats"),
    }

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The signal and the tone."""
        return signal + _tone(conditions.time_s, *(float(value) for value in values))

    def inverse(self, values: Array, step_s: float) -> Inverse:
        """Subtract it; exact."""
        cosine, sine, frequency = (float(value) for value in values)
        angle = f"{c_number(2.0 * math.pi * frequency)} * t"
        return Memoryless(
            lambda signal, time_s: signal - _tone(time_s, cosine, sine, frequency),
            f"x -= {c_number(cosine)} * cos({angle}) + {c_number(sine)} * sin({angle});",
        )

    def evidence(self, residual: Array, conditions: Conditions, prediction: Array) -> HumEvidence | None:
        """The strongest line in the spectrum of ``residual`` (n,), as `HumEvidence`; None where no line stands out.

        1. Each bin of the periodogram is divided by the mean of its neighbours. Where the noise is locally flat this
           has an F distribution (Fisher's test with a local floor); one false alarm in 1000 is allowed for the whole
           spectrum.
        2. That is done on the whole record, and on averages over segments of it, since the mains wander.
        3. A line is not taken that the ``prediction`` (n,) has as well (the load's own), that comes and goes (ringing),
           or that is quieter while the load rests (an effect of the moving load).
        """
        best: tuple[float, float, float, float] | None = None
        levelled = _levelled(residual) if residual.size >= LEAST_SAMPLES else residual
        for length in sorted({residual.size, min(residual.size, 2048)}):
            if length < LEAST_SAMPLES:
                continue
            found = _line(levelled, prediction, length, conditions.step_s)
            if found is not None and (best is None or found[0] < best[0]):
                best = found
        if best is None:
            return None
        _, ratio, threshold, near_hz = best
        frequency = _refined(residual, near_hz, conditions.step_s)
        if not _is_steady(residual, frequency, conditions.step_s):
            return None
        if not _stands_apart(residual, conditions.load, prediction, frequency, conditions.step_s):
            return None
        cosine, sine = _amplitudes(residual, frequency, conditions.step_s)
        sources = tuple(
            mains * harmonic
            for mains in MAINS_HZ
            for harmonic in range(1, HARMONICS + 1)
            if abs(alias_hz(mains * harmonic, conditions.step_s) - frequency)
            <= MAINS_TOLERANCE * mains * harmonic + 1.0 / (residual.size * conditions.step_s)
        )
        strength = math.sqrt(0.5 * (cosine**2 + sine**2))
        origin = (
            f", where {' or '.join(f'{source:g}' for source in sources)} Hz of the mains come out" if sources else ""
        )
        says = f"a tone of {percent(math.hypot(cosine, sine))} of full scale at {frequency:.4g} Hz{origin}"
        return HumEvidence("line_over_floor", ratio, threshold, says, strength, frequency, cosine, sine, sources)


def _tone(time_s: Array, cosine: float, sine: float, frequency: float) -> Array:
    """The tone (n,) at ``time_s`` (n,)."""
    if cosine == 0.0 and sine == 0.0:
        return np.zeros_like(time_s)
    angle = 2.0 * math.pi * frequency * time_s
    return cosine * np.cos(angle) + sine * np.sin(angle)


def alias_hz(frequency_hz: float, sample_time_s: float) -> float:
    """The frequency, 0 to the Nyquist frequency, at which a tone appears in a log with that sample time."""
    turns = frequency_hz * sample_time_s
    return abs(turns - round(turns)) / sample_time_s


def _powers(signal: Array, length: int) -> Array:
    """Periodograms (segments, bins) under a Hann window, of segments that do not overlap."""
    count = signal.size // length
    window = 0.5 - 0.5 * np.cos(2.0 * np.pi * (np.arange(length) + 0.5) / length)
    parts = signal[: count * length].reshape(count, length)
    return np.asarray(np.abs(np.fft.rfft((parts - parts.mean(axis=1, keepdims=True)) * window, axis=1)) ** 2)


def _over_floor(power: Array, half: int, apart: int) -> tuple[Array, Array]:
    """Each bin over the mean of its neighbours, ``apart`` + 1 to ``half`` bins away, and the number of these."""
    bins = power.size
    running = np.concatenate([[0.0], np.cumsum(power)])
    k = np.arange(bins)

    def within(width: int) -> tuple[Array, Array]:
        low, high = np.maximum(k - width, 0), np.minimum(k + width + 1, bins)
        return running[high] - running[low], (high - low).astype(float)

    (wide, many), (near, few) = within(half), within(apart)
    count = many - few
    # A difference of sums is no smaller than their rounding: a load of few tones leaves nothing else between them.
    rounding = np.finfo(float).eps * running[-1] + np.finfo(float).tiny
    return power * count / np.maximum(wide - near, rounding), count


def _line(
    residual: Array, prediction: Array, length: int, sample_time_s: float
) -> tuple[float, float, float, float] | None:
    """The strongest line that is steady and not the load's: chance, ratio to the floor, threshold, frequency; or None.

    ``length``: samples in a segment of the ``residual`` (n,).
    """
    from scipy.special import fdtrc, fdtri

    powers = _powers(residual, length)
    segments, bins = powers.shape
    half = NEIGHBOURS if segments == 1 else NEIGHBOURS // 3
    first = max(math.ceil(LOWEST_HZ * length * sample_time_s), 4)
    if bins - first < 2 * half:
        return None
    ratio, count = _over_floor(powers.mean(axis=0), half, 3)
    load_ratio, _ = _over_floor(_powers(prediction, length).mean(axis=0), half, 3)
    freedom = np.full(bins, 2.0 * segments)
    if length % 2 == 0:
        freedom[-1] = segments  # a real number at the Nyquist frequency
        freedom[-2] = 1.5 * segments
    rest = 2.0 * segments * count / HANN_CORRELATION
    chance = fdtrc(freedom, rest, ratio)
    allowed = 0.5 * FALSE_ALARMS / (bins - first)
    threshold = fdtri(freedom, rest, 1.0 - allowed)
    for k in np.argsort(chance[first:])[:20] + first:
        if ratio[k] <= threshold[k]:
            break
        near_hz = k / (length * sample_time_s)
        if load_ratio[k] <= 0.5 * threshold[k] and _is_steady(residual, near_hz, sample_time_s):
            return float(chance[k]), float(ratio[k]), float(threshold[k]), near_hz
    return None


def _tone_powers(parts: Array, at_hz: float, sample_time_s: float) -> Array:
    """(segments,) power of a tone in each of ``parts`` (segments, length), under a Hann window."""
    length = parts.shape[1]
    turned = np.exp(-2j * np.pi * sample_time_s * at_hz * np.arange(length)) * np.hanning(length)
    return np.asarray(np.abs(np.sum(parts * turned, axis=1)) ** 2)


def _is_steady(residual: Array, frequency_hz: float, sample_time_s: float) -> bool:
    """Whether the tone's power is much the same throughout the record, in segments of a thirtieth of it.

    The stronger the tone is above the floor beside it, the steadier it must be.
    """
    length = residual.size // SEGMENTS
    parts = residual[: SEGMENTS * length].reshape(SEGMENTS, length)
    apart_hz = 4.0 / (length * sample_time_s)
    power, *below = (_tone_powers(parts, frequency_hz - away * apart_hz, sample_time_s) for away in (0.0, 1.0, 1.5))
    floor = 0.5 * float(sum(np.mean(one) for one in below))
    over = max(float(np.mean(power)) / max(floor, 1e-300) - 1.0, 0.0)
    if frequency_hz > 0.5 / sample_time_s - apart_hz:
        # Near half the sampling rate the power of a tone depends on its phase, which turns slowly.
        return bool(np.median(power) > 0.5 * STEADY * np.mean(power))
    return bool(np.median(power) > (STEADY + (STEADIER - STEADY) * over / (over + 3.0)) * np.mean(power))


def _stands_apart(residual: Array, load: Array, prediction: Array, frequency_hz: float, sample_time_s: float) -> bool:
    """Whether the tone is as loud while the ``load`` (n,) rests as while it moves.

    Where there is too little of either to tell: whether it is no harmonic of the ``prediction`` (n,), as a curve or a
    loop makes of a load with a rhythm.
    """
    length = max(round(BLOCK_S / sample_time_s), 8)
    count = residual.size // length
    parts, loads = (one[: count * length].reshape(count, length) for one in (residual, load))
    half = length // 2
    rates = np.abs(loads[:, half:].mean(axis=1) - loads[:, :half].mean(axis=1)) / (half * sample_time_s)
    still = rates < STILL_PER_S
    if min(still.sum(), (~still).sum()) < LEAST_BLOCKS:
        return not _is_harmonic(prediction, frequency_hz, sample_time_s)
    apart_hz = 4.0 / (length * sample_time_s)
    centred = parts - parts.mean(axis=1, keepdims=True)
    whole, *above = (_tone_powers(centred, frequency_hz + away * apart_hz, sample_time_s) for away in (0.0, 1.0, 1.5))
    floor = 0.5 * (above[0] + above[1])
    resting = float(whole[still].mean() - floor[still].mean())
    moving = float(whole[~still].mean() - floor[~still].mean())
    # A power's standard deviation is as large as the power itself.
    unsure = 3.0 * float(floor[still].mean()) / math.sqrt(float(still.sum()))
    return resting + unsure > QUIETER * moving


def _is_harmonic(prediction: Array, frequency_hz: float, sample_time_s: float) -> bool:
    """Whether a curve would make such a line of a ``prediction`` (n,), as Chebyshev polynomials of it do."""
    low, high = float(prediction.min()), float(prediction.max())
    if low == high:
        return False
    angle = np.arccos(np.clip(2.0 * (prediction - low) / (high - low) - 1.0, -1.0, 1.0))
    near = round(frequency_hz * prediction.size * sample_time_s)
    for order in range(1, HARMONICS + 1):
        power = _powers(np.cos(order * angle), prediction.size)[0]
        if float(power[max(near - 1, 0) : near + 2].sum()) > OF_HARMONIC * float(power.sum()):
            return True
    return False


def _levelled(residual: Array) -> Array:
    """The residual (n,) over its own size nearby.

    Noise that comes in bursts has no lines, but its bins are uneven.
    """
    length = BURST_SAMPLES
    count = residual.size // length
    centred = residual - residual.mean()
    # Differences, so that a slow misfit does not count for noise.
    rough = np.abs(np.diff(centred, append=centred[-1]))[: count * length].reshape(count, length).mean(axis=1)
    size = np.interp(np.arange(residual.size), (np.arange(count) + 0.5) * length, rough)
    least = 0.1 * float(np.median(rough)) + 1e-9 * float(np.max(np.abs(centred)))  # where hardly any noise is at all
    return np.asarray(centred / np.maximum(size, least + 1e-300))


def _refined(residual: Array, near_hz: float, sample_time_s: float) -> float:
    """The frequency in Hz, within some bins of ``near_hz``, of the tone that explains most of the windowed record."""
    n, nyquist = residual.size, 0.5 / sample_time_s
    turns = -2j * np.pi * sample_time_s * np.arange(n)
    window = np.hanning(n)
    # Turned down by the frequency that is known already, means over blocks hold all that is left to search.
    block = max(n // 4096, 1)
    whole = n // block * block

    def blocks(values: Array) -> Array:
        return np.asarray(values[:whole].reshape(-1, block).sum(axis=1))

    slow, weight = blocks(np.exp(turns * near_hz) * window * (residual - residual.mean())), blocks(window)
    turns = turns[:whole:block]
    total = float(weight.sum())

    def explained(offset_hz: float) -> float:
        found = np.sum(np.exp(turns * offset_hz) * slow)
        # Near the Nyquist frequency the tone's mirror image stands within the window's peak, and is fitted with it.
        mirror = np.sum(np.exp(turns * 2.0 * (near_hz + offset_hz - nyquist)) * weight)
        rest = total - float(abs(mirror)) ** 2 / total
        if rest < 1e-3 * total:
            return float(abs(found)) ** 2 / (2.0 * total)
        return float(abs(found) ** 2 - (np.conj(mirror) * found**2).real / total) / rest

    width, centre = 2.0 / (min(n, 2048) * sample_time_s), 0.0
    while width > 0.02 / (n * sample_time_s):
        # The peak behind the window is four bins wide: a grid of half of that cannot step over it.
        count = max(9, 2 * math.ceil(width * n * sample_time_s) + 1)
        grid = np.clip(np.linspace(centre - width, centre + width, count), -near_hz, nyquist - near_hz)
        centre = float(grid[int(np.argmax([explained(offset) for offset in grid]))])
        width = 2.0 * width / (count - 1)
    return near_hz + centre


def _amplitudes(residual: Array, frequency_hz: float, sample_time_s: float) -> tuple[float, float]:
    """Cosine and sine part by least squares; at the Nyquist frequency, where the sine is 0, the smallest such pair."""
    angle = 2.0 * np.pi * frequency_hz * sample_time_s * np.arange(residual.size)
    c, s, r = np.cos(angle), np.sin(angle), residual - residual.mean()
    normal = np.array([[np.sum(c * c), np.sum(c * s)], [np.sum(c * s), np.sum(s * s)]])
    cosine, sine = np.linalg.pinv(normal, rcond=1e-9, hermitian=True) @ np.array([np.sum(c * r), np.sum(s * r)])
    return float(cosine), float(sine)
