"""The inverse of the linear network of wall and gas: load from pressure, sample by sample."""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.core import Core
from smartshoe.models.effects.effect import CStep, Inverse

RINGING = -0.5
"""An eigenvalue of the inverse below this changes sign at each sample and decays slowly: noise would ring."""


class CoreInverse(Inverse):
    """`Core.recursion` solved for the new load, which is exact for loads that are straight lines between samples.

    With z_k = A z_(k-1) + b f_(k-1) + c f_k and p = direct f + read . z, the stored state is z without the contribution
    of the new load, s_k = z_k - c f_k. Where the sampling is so coarse that this recursion rings (`RINGING`), the
    bilinear transform of the network replaces it, and ``is_exact`` is False. Its ringing stays bounded, as the
    network's zeros do not grow with time.
    """

    def __init__(self, core: Core, step_s: float) -> None:
        self._at(core, *core.recursion(step_s))
        self.is_exact = self._smallest_eigenvalue() >= RINGING
        if not self.is_exact:
            self._at(core, *_bilinear(core, step_s))
        self._push = None
        if self.read.size:
            from smartshoe.kernels.inverse_core import unload

            self._push = unload
        self.reset()

    def _at(self, core: Core, a: Array, b: Array, c: Array) -> None:
        steady = core.steady_state(1.0)
        self.transition = np.ascontiguousarray(a)
        self.drive = np.ascontiguousarray(a @ c + b)
        self.read = np.ascontiguousarray(core.read)
        self.direct = float(core.direct + core.read @ c)
        self.start = (steady - c) / float(core.direct + core.read @ steady)

    def _smallest_eigenvalue(self) -> float:
        own = np.linalg.eigvals(self.transition - np.outer(self.drive, self.read) / self.direct)
        return float(np.min(np.real(own), initial=np.inf))

    def reset(self) -> None:
        """Start in the steady state of the next pressure, with no accumulated leak."""
        self._state: Array | None = None

    def push(self, signal: Array, time_s: Array) -> Array:
        """Load (n,) from pressure (n,), both as shares of full scale."""
        if self._push is None:
            return signal  # a spring alone: pressure and load are the same share of full scale
        if not signal.size:
            return signal.copy()
        if self._state is None:
            self._state = self.start * signal[0]
        load = np.empty(signal.size)
        self._push(np.ascontiguousarray(signal), self.transition, self.drive, self.read, self.direct, self._state, load)
        return load

    def c_step(self, name: str) -> CStep:
        """C99 code of the recursion, with the same sums in the same order."""
        if self._push is None:
            return CStep({}, f"x /= {self.direct!r};")
        states, lines = self._solved(name)
        for i, row in enumerate(self.transition):
            terms = [f"{float(self.drive[i])!r} * x"]
            terms += [f"{float(value)!r} * f->{state}" for state, value in zip(states, row, strict=True) if value]
            lines.append(f"const double moved_{i} =\n    " + "\n    + ".join(terms) + ";")
        lines += [f"f->{state} = moved_{i};" for i, state in enumerate(states)]
        return self._step(name, states, lines)

    def c_single(self, name: str) -> CStep:
        """C99 code by increments of the state, for single precision.

        A slow state's transition is just below 1, of which single precision would keep only four digits.
        """
        if self._push is None:
            return self.c_step(name)
        states, lines = self._solved(name)
        for i, row in enumerate(self.transition - np.eye(len(states))):
            terms = [f"{float(self.drive[i])!r} * x"]
            terms += [f"{float(value)!r} * f->{state}" for state, value in zip(states, row, strict=True) if value]
            lines.append(f"const double moved_{i} =\n    " + "\n    + ".join(terms) + ";")
        lines += [f"f->{state} += moved_{i};" for i, state in enumerate(states)]
        return self._step(name, states, lines)

    def _solved(self, name: str) -> tuple[list[str], list[str]]:
        """Names of the states, and the C lines that initialise them and turn the pressure x into the load."""
        states = [f"{name}_{i}" for i in range(self.read.size)]
        begun = f"{name}_begun"
        lines = [f"if (!(f->{begun} > 0.0)) {{"]
        lines += [f"    f->{state} = {float(value)!r} * x;" for state, value in zip(states, self.start, strict=True)]
        lines += [f"    f->{begun} = 1.0;", "}"]
        lines += [f"x -= {float(value)!r} * f->{state};" for state, value in zip(states, self.read, strict=True)]
        return states, [*lines, f"x /= {self.direct!r};"]

    def _step(self, name: str, states: list[str], lines: list[str]) -> CStep:
        body = "\n".join(f"    {line}" for text in lines for line in text.split("\n"))
        return CStep({**dict.fromkeys(states, 0.0), f"{name}_begun": 0.0}, f"{{\n{body}\n}}")


def _bilinear(core: Core, step_s: float) -> tuple[Array, Array, Array]:
    """A, b, c as in `Core.recursion`, by the trapezoidal rule."""
    half = 0.5 * step_s * core.matrix
    one = np.eye(half.shape[0])
    pushed = np.asarray(np.linalg.solve(one - half, 0.5 * step_s * core.drive), dtype=float)
    return np.asarray(np.linalg.solve(one - half, one + half), dtype=float), pushed, pushed
