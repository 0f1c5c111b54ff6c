"""Limits how much an inverse amplifies noise, by low-passes behind it that are no slower than necessary."""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.effects.effect import CStep, Inverse

MOST = 3.0
"""Largest gain of a block for a signal that alternates from sample to sample. Undoing a lag T has 1 + 2 T/step,
which without a bound grows as the sampling gets finer. For lags of 5 to 60 ms at 100 and 500 Hz and noise of 0.05 and
0.1 % of full scale, 3 to 5 leave the least error of the force on the paper's triangles."""


def noise_gain(inverse: Inverse) -> float:
    """The gain of a linear ``inverse`` for a signal that alternates from sample to sample; resets the inverse."""
    inverse.reset()
    answer = inverse.push(np.resize([1.0, -1.0], 64), np.zeros(64))
    inverse.reset()
    return float(abs(answer[-1]))


class NoiseLimit(Inverse):
    """Two first-order low-passes in series that together pass an alternating signal with ``gain`` (0 to 1).

    Each is y_k = w x_k + (1 - w) y_(k-1): it scales an alternating signal by w/(2 - w), leaves a constant as it is, and
    delays a ramp by 1/w - 1 steps. Two cause a far shorter delay than a single one of the same gain.
    """

    def __init__(self, gain: float) -> None:
        root = float(np.sqrt(gain))
        self.weight = 2.0 * root / (1.0 + root)
        self.lag_steps = 2.0 / self.weight - 2.0
        self.reset()

    def reset(self) -> None:
        """Start in the steady state of the next value."""
        self._states: list[Array] | None = None

    def push(self, signal: Array, time_s: Array) -> Array:
        """The smoothed signal (n,)."""
        from scipy.signal import lfilter

        if not signal.size:
            return signal.copy()
        keep = 1.0 - self.weight
        if self._states is None:
            self._states = [np.array([keep * signal[0]])] * 2
        for stage, state in enumerate(self._states):
            signal, self._states[stage] = lfilter([self.weight], [1.0, -keep], signal, zi=state)
        return signal

    def c_step(self, name: str) -> CStep:
        """C99 code with the same sums."""
        first, second, begun, keep = f"{name}_first", f"{name}_second", f"{name}_begun", repr(1.0 - self.weight)
        body = f"""{{
    if (!(f->{begun} > 0.0)) {{
        f->{first} = {keep} * x;
        f->{second} = {keep} * x;
        f->{begun} = 1.0;
    }}
    x = {self.weight!r} * x + f->{first};
    f->{first} = {keep} * x;
    x = {self.weight!r} * x + f->{second};
    f->{second} = {keep} * x;
}}"""
        return CStep({first: 0.0, second: 0.0, begun: 0.0}, body)
