"""Lines that were told as hum, taken out of a residual before it is asked what is left and what of it is structure.

A hum is no effect, and what it adds is told by itself. Where load cycles last for whole periods of it, it repeats with
them as an effect does. Only lines that were told are taken out: a slower or unsteady tone stays, and so does all else.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.fft import next_fast_len, rfft

from smartshoe.arrays import Array, Mask
from smartshoe.diagnosis._averaging import smoothed, thinning_weights
from smartshoe.diagnosis._session import Session
from smartshoe.integrity import DataFault

FINER = 4  # points of a spectrum in each bin: what is nearer than half of one, Newton's steps find
STEPS = 3  # of Newton's, of which each leaves a few percent of what the frequency was off by


def lines_of(session: Session, faults: Sequence[DataFault]) -> tuple[float, ...]:
    """Frequencies in Hz of the lines that ``faults`` tell of a recording, each once, the strongest of each first."""
    told = (line for fault in faults if fault.recording == session.index for line in fault.lines_hz)
    return tuple(dict.fromkeys(told))


def reported_tones(fine: Session, residual: Array, lines_hz: Sequence[float]) -> Array:
    """(n,) the tones at ``lines_hz`` in a ``residual`` (n,) at the full rate, by least squares of sines and cosines.

    They are those of the samples that a fit may use, or of all usable ones where it may use none. A line was told to
    within a bin of the spectrum or two, and stands where it is strongest there.
    """
    seen = fine.fitted if fine.fitted.any() else fine.usable
    tones = np.zeros(residual.size)
    if not seen.any():
        return tones
    for line_hz in lines_hz:
        left = np.where(seen, residual - tones, 0.0)
        tones += _tone(left - np.where(seen, left[seen].mean(), 0.0), seen, line_hz, fine.conditions.step_s)
    return tones


def as_thinned(tones: Array, session: Session) -> Array:
    """(m,) ``tones`` (n,) at the full rate as they come out in a ``session``, which was averaged and thinned."""
    return smoothed(tones, thinning_weights(session.thinned, tones.size), session.thinned)


def _tone(residual: Array, seen: Mask, told_hz: float, step_s: float) -> Array:
    """(n,) the tone near ``told_hz`` in a ``residual`` (n,) without a mean, 0 where it is not ``seen`` (n,)."""
    time_s = step_s * np.arange(residual.size, dtype=np.float64)
    bin_hz = 1.0 / (step_s * residual.size)
    frequency_hz = _strongest_near(residual, told_hz, step_s)
    for _ in range(STEPS):
        cosine, sine, by_cosine, by_sine = _least_squares(residual, seen, frequency_hz, time_s, [0, 1])
        turned = by_cosine * sine - by_sine * cosine  # of phase a second, times the squared amplitude
        off_hz = turned / (2.0 * np.pi * max(cosine**2 + sine**2, 1e-300))
        frequency_hz += float(np.clip(off_hz, -bin_hz, bin_hz))
    cosine, sine = _least_squares(residual, seen, frequency_hz, time_s, [0])
    angle = 2.0 * np.pi * frequency_hz * time_s
    return np.asarray(cosine * np.cos(angle) + sine * np.sin(angle))


def _strongest_near(residual: Array, told_hz: float, step_s: float) -> float:
    """The frequency in Hz, within two bins of ``told_hz``, at which the spectrum of a ``residual`` (n,) is largest."""
    size = int(next_fast_len(FINER * residual.size, real=True))
    power = np.abs(rfft(residual, size)) ** 2
    finer_hz = 1.0 / (size * step_s)
    first = max(round(told_hz / finer_hz) - 2 * FINER, 0)
    return finer_hz * float(first + np.argmax(power[first : first + 4 * FINER + 1]))


def _least_squares(residual: Array, seen: Mask, frequency_hz: float, time_s: Array, powers: Sequence[int]) -> Array:
    """(2 p,) amplitudes of cosine and sine, times each of the ``powers`` of the time from the middle."""
    angle = 2.0 * np.pi * frequency_hz * time_s
    middle_s = 0.5 * float(time_s[-1])
    at = (time_s - middle_s) / max(middle_s, 1e-300)
    columns = np.column_stack([at**power * wave(angle) for power in powers for wave in (np.cos, np.sin)])[seen]
    found = np.linalg.pinv(columns.T @ columns, rcond=1e-9, hermitian=True) @ (columns.T @ residual[seen])
    found[2:] /= max(middle_s, 1e-300)
    return np.asarray(found)
