"""A sensing unit's air bladder from physics: wall, sealed air, contact, and the effects that a scenario switches on.

*Scale.* The paper writes its force f as a pressure (Chinimilli 2016, eq. 2). Converting a load in newton to a contact
stress in pascal takes an area, and the coil's own 40 cm^2 would give 2 bar at 800 N, ten times the sensor's range and
above its burst pressure. Most of the load must pass beside the tube; an *effective area* models that, f = F /
effective_area. Eq. (2) at full scale requires 226 cm^2 (467 cm^2 for the toe's 100 mbar sensor).

*Equations.* Stresses in units of the ambient pressure p0, e the compressed share of the air's volume, K = k x0^2/(nRT):

    f/p0 = p + K1 e (hardening)(softening) + K2 (e - q),    q' = (e - q) k2/c           wall and force balance
    p = e - w + theta + dT/T0                 or  (1 - w)(1 + theta + dT/T0)/(1 - e) - 1 (Boyle)        sealed air
    w' = rate p  or  rate sqrt|p| sgn p,      theta' = -theta/tau + fraction (gamma - 1) e'/(1 - e)

With every effect off this is eq. (2)-(4): P/f = (s + k2/c) / ([1 + K1 + K2] s + (k2/c)(1 + K1)). The scheme is exact
for a deformation that is linear within a step (the arm, the heat), two-step Adams-Bashforth for the slow leak, and a
safeguarded Newton iteration for the balance: second order, stable at any step for the wall.

Further effects of the wall, the air and the contact are in `simulators.effects`, one file per family, and are stepped
by `simulators.plant._wall_stepping` if a unit has any of them.

*Left out:* inertia and the tube's acoustics (both far above 1 kHz), buckling and contact of the tube's own walls
(bottoming out), temperature of the wall, humidity, shear.
"""

from __future__ import annotations

from math import ceil

import numpy as np

from simulators.plant.bladder_parameters import AMBIENT_PA, BladderParameters
from smartshoe.arrays import Array
from smartshoe.devices import Bladder
from smartshoe.errors import UsageError

LOWEST_STEP_HZ = 1000.0


class SimulatedBladder(Bladder):
    """A bladder that keeps its memory between calls of `press`; the module's docstring says what it leaves out."""

    def __init__(self, parameters: BladderParameters) -> None:
        from simulators.plant._steppers import stepper

        self.parameters = parameters
        self._stepper = stepper(parameters)
        self._session = -1
        self.reset()

    def reset(self) -> None:
        """Return to rest: unloaded, in steady state, without memory of past loads, at the initial temperature."""
        self._session += 1
        self._stepper.reset(self._session)
        self.deformation = np.zeros(0)

    def press(self, load_n: Array, sample_rate_hz: float) -> Array:
        """Gauge pressure (n,) in Pa under ``load_n`` (n,) in N, compression positive; continues from the last call.

        The load is linear between samples, and from the last sample of the call before (or rest) to the first; the
        inner step is 1 ms or finer. Afterwards ``deformation`` (n,) holds the compressed share of the volume. Raises
        `UsageError` where a load is not finite.
        """
        load = np.ascontiguousarray(load_n, dtype=float)
        if not np.isfinite(load).all():
            at = int(np.argmin(np.isfinite(load)))
            raise UsageError(f"load sample {at + 1} of {load.size} is not finite: fill gaps before pressing")
        finer = max(1, ceil(LOWEST_STEP_HZ / sample_rate_hz - 1e-9))
        pressure, self.deformation = self._stepper.advance(load, finer, 1.0 / (sample_rate_hz * finer))
        return pressure * AMBIENT_PA
