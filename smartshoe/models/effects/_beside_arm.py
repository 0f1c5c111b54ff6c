"""Inverses of springs that bend beside the relaxing arm: the load that the arm bears is taken off first.

The blocks solve f = phi(u) + kappa (u - q), q' = a (u - q), with u the deformation (`smartshoe.models.effects`). Given
u, the load follows directly.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.effects.effect import CStep, Inverse
from smartshoe.models.elements import Arm
from smartshoe.models.first_order import hold_coefficients


class _Lag:
    """w = alpha/(s + alpha) u on a stream of straight lines, started in the steady state of its first value."""

    def __init__(self, alpha: float, step_s: float) -> None:
        self.decay, self.now, self.before = (float(value) for value in hold_coefficients(alpha * step_s))
        self.reset()

    def reset(self) -> None:
        self._state: Array | None = None

    def push(self, u: Array) -> Array:
        from scipy.signal import lfilter

        if not u.size:
            return u.copy()
        if self._state is None:
            self._state = np.array([u[0] - self.now * u[0]])
        w, self._state = lfilter([self.now, self.before], [1.0, -self.decay], u, zi=self._state)
        return np.asarray(w)

    def c_lines(self, state: str, begun: str, into: str, given: str) -> str:
        """C that declares ``into``, the lag of the double ``given``; ``state`` and ``begun`` are of the struct."""
        return f"""    if (!({begun} > 0.0)) {{
        {state} = {given} - {self.now!r} * {given};
    }}
    const double {into} = {self.now!r} * {given} + {state};
    {state} = {self.before!r} * {given} + {self.decay!r} * {into};
"""

    def c_increments(self, state: str, begun: str, into: str, given: str) -> str:
        """`c_lines` for single precision: ``state`` is the lag itself, ``state``_before the last ``given``."""
        return f"""    if (!({begun} > 0.0)) {{
        {state} = {given};
        {state}_before = {given};
    }}
    {{
        const double step = {self.now!r} * ({given} - {state}) + {self.before!r} * ({state}_before - {state});
        {state} += step;
        {state}_before = {given};
    }}
    const double {into} = {state};
"""


class BesideArm(Inverse):
    """The inverse of a block of the wall beside the relaxing ``arm`` (share kappa, rate a).

    The core is given u + kappa (u - q), of which the arm bears kappa (u - q); ``spring`` turns the rest, u, into
    phi(u).
    """

    def __init__(self, spring: Inverse, arm: Arm, step_s: float) -> None:
        self.spring = spring
        self.part = arm.share / (1.0 + arm.share)
        self.lag = _Lag(arm.rate_per_s / (1.0 + arm.share), step_s)

    def reset(self) -> None:
        """Start in the steady state of the next value."""
        self.spring.reset()
        self.lag.reset()

    def push(self, signal: Array, time_s: Array) -> Array:
        """Load (n,) on spring and arm together, from what the core is given, ``signal`` (n,)."""
        arm = self.part * (signal - self.lag.push(signal))
        return np.asarray(self.spring.push(signal - arm, time_s) + arm)

    def c_step(self, name: str) -> CStep:
        """The spring's C step, with the arm's load taken off before it and put back after it."""
        return self._around(name, self.spring.c_step(name), self.lag.c_lines)

    def c_single(self, name: str) -> CStep:
        """`c_step` with the lag by increments, for single precision."""
        return self._around(name, self.spring.c_single(name), self.lag.c_increments)

    def _around(self, name: str, step: CStep, lag: Callable[[str, str, str, str], str]) -> CStep:
        lag_state, begun, arm = f"{name}_lag", f"{name}_begun", f"{name}_arm"
        lagged = lag(f"f->{lag_state}", f"f->{begun}", f"{name}_lagged", "x")
        body = f"""{{
{lagged}    const double {arm} = {self.part!r} * (x - {name}_lagged);
    f->{begun} = 1.0;
    x -= {arm};
    {step.body}
    x += {arm};
}}"""
        return CStep({**step.states, **_members(body, lag_state), begun: 0.0}, body)


class GasBesideArm(Inverse):
    """The inverse of a block of the gas: from the pressure, the pressure that the linear core would have given.

    ``spring`` turns the pressure into the load on wall spring and gas, whose deformation is (1 + g) p/(1 + g p), with
    ``ratio`` g.
    """

    def __init__(self, spring: Inverse, ratio: float, arm: Arm, step_s: float) -> None:
        self.spring, self.ratio, self.share = spring, ratio, arm.share
        self.part = arm.share / (1.0 + arm.share)
        self.arm = _Lag(arm.rate_per_s, step_s)
        self.core = _Lag(arm.rate_per_s / (1.0 + arm.share), step_s)

    def reset(self) -> None:
        """Start in the steady state of the next value."""
        self.spring.reset()
        self.arm.reset()
        self.core.reset()

    def push(self, signal: Array, time_s: Array) -> Array:
        """The linear core's pressure (n,)."""
        deformation = (1.0 + self.ratio) * signal / (1.0 + self.ratio * signal)
        arm = self.share * (deformation - self.arm.push(deformation))
        load = self.spring.push(signal, time_s) + arm
        return np.asarray(load - self.part * (load - self.core.push(load)))

    def c_step(self, name: str) -> CStep:
        """The spring's C step, with the arm's load added after it and the linear core's relaxation taken off."""
        return self._around(name, self.spring.c_step(name), _Lag.c_lines)

    def c_single(self, name: str) -> CStep:
        """`c_step` with the lags by increments, for single precision."""
        return self._around(name, self.spring.c_single(name), _Lag.c_increments)

    def _around(self, name: str, step: CStep, lag: Callable[[_Lag, str, str, str, str], str]) -> CStep:
        arm, core, begun, bent = (f"{name}_{word}" for word in ("arm", "core", "begun", "bent"))
        body = f"""{{
    const double {bent} = {1.0 + self.ratio!r} * x / (1.0 + {self.ratio!r} * x);
{lag(self.arm, f"f->{arm}", f"f->{begun}", f"{name}_relaxed", bent)}    {step.body}
    x += {self.share!r} * ({bent} - {name}_relaxed);
{lag(self.core, f"f->{core}", f"f->{begun}", f"{name}_lagged", "x")}    f->{begun} = 1.0;
    x -= {self.part!r} * (x - {name}_lagged);
}}"""
        return CStep({**step.states, **_members(body, arm), **_members(body, core), begun: 0.0}, body)


def _members(body: str, lag: str) -> dict[str, float]:
    """The members of the struct that the C of a ``lag`` uses, with their initial values."""
    return {name: 0.0 for name in (lag, f"{lag}_before") if f"f->{name}" in body}
