"""1/A(s) and 1/A(s)^2 between samples, exactly: steps or straight lines, any delay, even or uneven steps.

The chain is ``A(p) x = u``, ``A(p) w = x`` with p = d/dt; its states are x, w and their first n - 1 derivatives. From
them everything follows without numerical differentiation: the model's output, its derivatives with respect to every
coefficient (`StateVariableFilter.numerator_map`, `StateVariableFilter.denominator_map`), and the filtered derivatives
that SRIVC needs. The transition over a step is a block of the exponential of the system with its input as further
states (Van Loan 1978).
Each state is scaled by a power of two that balances the matrix (`scipy.linalg.matrix_balance`), which is time
measured in the roots' radius where they have one, and better where they are spread.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from smartshoe.arrays import Array

Intersample = Literal["zoh", "foh"]
EVEN_DELAY = 1e-12  # of a step: a delay this near whole samples is taken as whole


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Balanced states (count, m), with the delayed input (count,) and its slope (count,) at the same times."""

    states: Array
    value: Array
    slope: Array


@dataclass(frozen=True, eq=False)
class StateVariableFilter:
    """The chain for ``denominator`` (n,), its coefficients without the leading 1, highest power first.

    With ``levels`` 2 the chain has w and x, with 1 only x. Balanced states times ``scale`` are w and its derivatives,
    then x and its derivatives, lowest first. ``matrix`` includes the input and its slope as two further states.
    """

    denominator: Array
    levels: int = 2
    matrix: Array = field(init=False)
    scale: Array = field(init=False)
    input_scale: Array = field(init=False)
    _cache: dict[float, Array] = field(init=False, default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        from scipy.linalg import matrix_balance

        n, m = self.order, self.size
        matrix = np.zeros((m + 2, m + 2))
        for block in range(self.levels):
            at = block * n
            matrix[at : at + n - 1, at + 1 : at + n] = np.eye(n - 1)
            matrix[at + n - 1, at : at + n] = -self.denominator[::-1]
            matrix[at + n - 1, at + n if at + n < m else m] = 1.0
        matrix[m, m + 1] = 1.0
        balanced, (scale, _) = matrix_balance(matrix, permute=False, separate=True)
        object.__setattr__(self, "matrix", balanced)
        object.__setattr__(self, "scale", scale[:m])
        object.__setattr__(self, "input_scale", scale[m:])

    @property
    def order(self) -> int:
        """n, the number of poles."""
        return int(self.denominator.size)

    @property
    def size(self) -> int:
        """The number of states m."""
        return self.levels * self.order

    def transition(self, step_s: float) -> Array:
        """exp(matrix step), (m + 2, m + 2), in balanced states."""
        from scipy.linalg import expm

        known = self._cache.get(step_s)
        if known is None:
            known = self._cache[step_s] = np.asarray(expm(self.matrix * step_s))
        return known

    def taps(self, step_s: float, hold: Intersample, fraction: float) -> Array:
        """Weights (3, m) of u[k - d - 1], u[k - d], u[k - d + 1] in the states at k + 1.

        The delay is d + fraction steps. A fraction f splits the step where the delayed input changes: the first f of it
        belongs to the older sample.
        """
        m = self.size
        per_value, per_slope = 1.0 / self.input_scale[0], 1.0 / (self.input_scale[1] * step_s)
        late = self.transition((1.0 - fraction) * step_s)
        taps = np.zeros((3, m))
        value, slope = late[:m, m] * per_value, late[:m, m + 1] * per_slope
        if hold == "zoh":
            taps[1] = value
        else:
            taps[1], taps[2] = value - slope, slope
        if fraction > 0.0:
            early = self.transition(fraction * step_s)
            value = late[:m, :m] @ early[:m, m] * per_value
            if hold == "zoh":
                taps[0] = value
            else:
                slope = late[:m, :m] @ early[:m, m + 1] * per_slope
                taps[0] = fraction * value - slope
                taps[1] += (1.0 - fraction) * value + slope
        return taps

    def impulse(self) -> Array:
        """Balanced states (m,) just after an impulse on the first equation A(p) x = u."""
        state = np.zeros(self.size)
        state[-1] = 1.0 / self.scale[-1]
        return state

    def steady(self, value: float) -> Array:
        """Balanced states (m,) in equilibrium with a constant input; not finite where a pole is 0."""
        n = self.order
        state = np.zeros(self.size)
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            level = value / self.denominator[-1]
            state[self.size - n] = level / self.scale[self.size - n]
            if self.levels == 2:
                state[0] = level / self.denominator[-1] / self.scale[0]
        return state

    def derivatives_of_x(self) -> tuple[Array, Array]:
        """Rows (n + 2, m) that give x and its derivatives up to n + 1 from balanced states.

        Also their coefficients (n + 2, 2) of the input's value and slope.
        """
        n, m = self.order, self.size
        rows, inputs = np.zeros((n + 2, m)), np.zeros((n + 2, 2))
        rows[:n, m - n :] = np.diag(self.scale[m - n :])
        ascending = self.denominator[::-1]
        rows[n], inputs[n, 0] = -ascending @ rows[:n], 1.0
        rows[n + 1], inputs[n + 1] = -ascending @ rows[1 : n + 1], -ascending @ inputs[1 : n + 1]
        inputs[n + 1, 1] += 1.0
        return rows, inputs

    def derivatives_of_w(self) -> Array:
        """Rows (2 n, m) that give w and its derivatives up to 2 n - 1 from balanced states."""
        n, m = self.order, self.size
        rows = np.zeros((2 * n, m))
        rows[:n, :n] = np.diag(self.scale[:n])
        ascending = self.denominator[::-1]
        for i in range(n):
            rows[n + i] = -ascending @ rows[i : i + n]
            rows[n + i, n + i] += self.scale[n + i]
        return rows

    def denominator_map(self, numerator: Array) -> Array:
        """Rows (n, m), highest power first: minus d y/d a for y = B/A u, from balanced states; ``numerator`` as B."""
        n = self.order
        rows = self.derivatives_of_w()
        out = np.zeros((n, self.size))
        for power, coefficient in enumerate(numerator[::-1]):
            out += coefficient * rows[power : power + n]
        return out[::-1]

    def run_even(
        self, u: Array, first: int, count: int, start: Array, step_s: float, hold: Intersample, delay_s: float
    ) -> Trajectory:
        """``count`` states from ``start`` at sample ``first`` on; beyond its ends u keeps its end values."""
        from smartshoe.kernels.polynomial import run_even

        whole, fraction = split_delay(delay_s, step_s)
        begin = first - whole - 1
        before, after = max(-begin, 0), max(begin + count + 2 - u.size, 0)
        padded = np.concatenate([np.full(before, u[0]), u, np.full(after, u[-1])]) if before or after else u
        m, begin = self.size, begin + before
        columns = np.ascontiguousarray(self.transition(step_s)[:m, :m].T)
        out = np.empty((count, m))
        leading = self.order if self.levels == 2 else 0
        run_even(columns, self.taps(step_s, hold, fraction), padded, begin, start, leading, out)
        older, now = padded[begin : begin + count], padded[begin + 1 : begin + 1 + count]
        if hold == "zoh":
            return Trajectory(out, now if fraction == 0.0 else older, np.zeros(count))
        newer = padded[begin + 2 : begin + 2 + count]
        if fraction == 0.0:
            return Trajectory(out, now, (newer - now) / step_s)
        return Trajectory(out, now + fraction * (older - now), (now - older) / step_s)

    def run_uneven(
        self, u: Array, knots: Array, time_s: Array, start: Array, hold: Intersample, delay_s: float
    ) -> Trajectory:
        """States at ``time_s`` (count,) from ``start`` at the first of them.

        ``u`` is given at ``knots`` and delayed.
        """
        from smartshoe.kernels.polynomial import run_uneven

        m, count = self.size, time_s.size
        # In balanced states the input is divided by its own scale.
        matrix = self.matrix.copy()
        matrix[:m, m] /= self.input_scale[0]
        matrix[m, m + 1] = 1.0
        norm = float(np.linalg.norm(matrix[:m, :m], 1))
        out, value, slope = np.empty((count, m)), np.zeros(count), np.zeros(count)
        # Sums of times and a delay that should be equal differ by rounding.
        slack = 1e-15 * float(np.max(np.abs(time_s)) + abs(delay_s)) + EVEN_DELAY * float(
            np.min(np.diff(time_s), initial=1.0)
        )
        run_uneven(matrix, norm, time_s, knots + delay_s, u, int(hold == "foh"), start, slack, out, value, slope)
        return Trajectory(out, value, slope)

    def run_free(self, time_s: Array, step_s: float | None) -> Array:
        """States (count, m) after an impulse at the first of ``time_s``.

        ``step_s`` is None where the times are uneven.
        """
        from smartshoe.kernels.polynomial import run_even

        if step_s is None:
            return self.run_uneven(np.empty(0), np.empty(0), time_s, self.impulse(), "zoh", 0.0).states
        m = self.size
        out = np.empty((time_s.size, m))
        columns = np.ascontiguousarray(self.transition(step_s)[:m, :m].T)
        leading = self.order if self.levels == 2 else 0
        run_even(columns, np.empty((0, m)), np.empty(0), 0, self.impulse(), leading, out)
        return out


def prefilter(order: int, lambda_rad_s: float) -> StateVariableFilter:
    """The state-variable filter 1/(s + lambda)^order."""
    return StateVariableFilter(np.asarray(np.poly(np.full(order, -lambda_rad_s))[1:], dtype=float), levels=1)


def split_delay(delay_s: float, step_s: float) -> tuple[int, float]:
    """Whole steps and the remaining fraction, 0 <= fraction < 1, freed of rounding."""
    steps = delay_s / step_s
    whole = int(np.floor(steps + EVEN_DELAY))
    fraction = steps - whole
    return whole, fraction if fraction > EVEN_DELAY * max(1.0, abs(steps)) else 0.0
