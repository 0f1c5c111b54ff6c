"""Wall and gas as one linear network: relaxing arms, heat of compression and a leak, exact between samples.

All signals are shares of full scale: u is the wall's deformation, scaled so that it equals the load f at rest; p is the
pressure, scaled alike. N = 1 + k1 x0^2/(nRT) is the stiffness of wall spring and gas together over the gas's alone.
Arms have the shares kappa_i and rates a_i, heat the share Gamma and rate b; omega is what has leaked. From the balance
of Chinimilli 2016, eq. (2):

    (1 + sum kappa + Gamma/N) u = f + sum kappa q + (Gamma/N) r + (1 + Gamma) omega/N
    q' = a (u - q),   r' = b (x - r),   omega' = lambda p,   p = x + Gamma (x - r),   x = u - omega

One arm alone is the paper's model: p/f = (s + a)/((1 + kappa) s + a). Springs and dampers alone have real poles, so the
network runs as a sum of first-order recursions.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property, lru_cache

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.elements import Arm, Element, Heat, Leak

MOST_SKEWED = 1e9  # condition of the modes' vectors
PAPER_WALL_RATIOS = 1.51, 1.78  # least and largest N of the paper's four units (Table 1)
USUAL_WALL_RATIO = 1.6


class Core:
    """The network of ``elements``; ``wall_ratio`` is N.

    Its states (p,) follow state' = ``matrix`` state + ``drive`` f; the pressure is ``read`` state + ``direct`` f.
    """

    def __init__(self, elements: Sequence[Element], wall_ratio: float = USUAL_WALL_RATIO) -> None:
        arms = [e for e in elements if isinstance(e, Arm) and e.share != 0.0]
        heats = [e for e in elements if isinstance(e, Heat) and e.share != 0.0]
        leak = sum(e.rate_per_s for e in elements if isinstance(e, Leak))
        inner = [*((e.share, e.rate_per_s) for e in arms), *((e.share / wall_ratio, e.rate_per_s) for e in heats)]
        heated = 1.0 + sum(e.share for e in heats)
        gain = np.array([share for share, _ in inner] + ([heated / wall_ratio] if leak else []))
        # Elements of equal rates would have modes that cannot be told apart.
        rate = np.array([value * (1.0 + 1e-7 * k) for k, (_, value) in enumerate(inner)])
        heat = np.array([0.0] * len(arms) + [e.share for e in heats] + ([heated] if leak else []))
        stiffness = 1.0 + sum(share for share, _ in inner)
        to_u = gain / stiffness
        n = gain.size
        matrix, drive = np.zeros((n, n)), np.zeros(n)
        for k, value in enumerate(rate):
            matrix[k] = value * to_u
            matrix[k, k] -= value
            if leak and k >= len(arms):  # heat is of the gas, whose deformation lacks what has leaked
                matrix[k, -1] -= value
            drive[k] = value / stiffness
        read = heated * to_u - heat
        direct = heated / stiffness
        if leak:
            matrix[-1] = leak * read
            drive[-1] = leak * direct
        self.matrix, self.drive, self.read, self.direct = matrix, drive, read, float(direct)
        self._memory = len(inner)
        self._known_modes: dict[float, tuple[Array, Array, Array, Array, Array]] = {}

    def steady_state(self, load: float) -> Array:
        """States (p,) of arms and heat in the steady state of a ``load``; nothing has leaked."""
        state = np.zeros(self.drive.size)
        state[: self._memory] = load
        return state

    def _modes(self, step_s: float) -> tuple[Array, Array, Array, Array, Array]:
        """`_modes_at` a step, cached, since a chain is run many times with its core unchanged."""
        if step_s not in self._known_modes:
            self._known_modes[step_s] = self._modes_at(step_s)
        return self._known_modes[step_s]

    @cached_property
    def _vectors(self) -> tuple[Array, Array, Array]:
        """The poles (p,) in 1/s, the matrix (p, p) from modes to states, and that from states to modes."""
        if self.drive.size == 1:
            return self.matrix[0], np.ones((1, 1)), np.ones((1, 1))
        # Two modes of one pole have no vectors of their own. Poles are moved apart by a millionth where needed.
        apart = 1e-6 * np.diag(np.diag(self.matrix) * np.arange(self.drive.size))
        for shift in (0.0, 1.0, 10.0):
            values, vectors = (np.real(found) for found in np.linalg.eig(self.matrix + shift * apart))
            inverse = _inverse(vectors)
            if inverse is not None and np.linalg.norm(vectors) * np.linalg.norm(inverse) < MOST_SKEWED:
                return values, vectors, inverse
        return values, vectors, np.asarray(np.linalg.pinv(vectors), dtype=np.float64)

    def _modes_at(self, step_s: float) -> tuple[Array, Array, Array, Array, Array]:
        """The modes' recursion at a step: ``decay``, ``before`` and ``after`` (p,), and the two matrices of `_vectors`.

        A mode is ``decay`` times its last value, plus ``before`` times the last load, plus ``after`` times the present
        one.
        """
        values, vectors, inverse = self._vectors
        z = -values * step_s
        decay = np.exp(-z)
        small = np.abs(z) < 1e-4
        safe = np.where(small, 1.0, z)
        mean = -np.expm1(-safe) / safe
        after, before = (1.0 - mean) / safe, (mean - np.exp(-safe)) / safe
        if small.any():
            after = np.where(small, 0.5 - z / 6.0 + z * z / 24.0, after)
            before = np.where(small, 0.5 - z / 3.0 + z * z / 8.0, before)
        scale = step_s * (inverse @ self.drive)
        return decay, scale * before, scale * after, vectors, inverse

    def simulate(self, load: Array, step_s: float) -> Array:
        """Pressure (n,) for a ``load`` (n,), shares of full scale, at a step of ``step_s``, from steady state."""
        if not self.drive.size:
            return self.direct * load
        from smartshoe.kernels.modal import respond

        decay, before, after, vectors, inverse = self._modes(step_s)
        out = np.empty(load.size)
        state = inverse @ self.steady_state(float(load[0]))
        respond(np.ascontiguousarray(load), decay, before, after, self.read @ vectors, self.direct, state, out)
        return out

    def recursion(self, step_s: float) -> tuple[Array, Array, Array]:
        """A (p, p), b (p,), c (p,) of z_k = A z_(k-1) + b f_(k-1) + c f_k, for straight lines between samples."""
        from scipy.linalg import expm

        n = self.drive.size
        block = np.zeros((n + 2, n + 2))
        block[:n, :n] = self.matrix * step_s
        block[:n, n] = self.drive * step_s
        block[n, n + 1] = 1.0
        whole = expm(block)
        ramp = whole[:n, n + 1]  # the response to a slope of one a step; the rest of a hold's is by the old sample
        return whole[:n, :n], whole[:n, n] - ramp, ramp


@lru_cache(maxsize=256)
def network(elements: tuple[Element, ...], wall_ratio: float) -> Core:
    """The `Core` of these elements, cached with its modes: models that differ elsewhere in the chain share it."""
    return Core(elements, wall_ratio)


def _inverse(vectors: Array) -> Array | None:
    """The inverse (p, p) of a matrix of ``vectors``; None where there is none."""
    try:
        return np.asarray(np.linalg.inv(vectors))
    except np.linalg.LinAlgError:
        return None


def plain(core: Core, load: Array, step_s: float) -> Array:
    """`Core.simulate` sample by sample, by the matrix exponential: the slow twin for tests."""
    a, b, c = core.recursion(step_s)
    state = core.steady_state(float(load[0]))
    out = np.empty(load.size)
    for k in range(load.size):
        if k:
            state = a @ state + b * load[k - 1] + c * load[k]
        out[k] = core.direct * load[k] + core.read @ state
    return out
