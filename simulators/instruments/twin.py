"""A specimen made from a unit's own calibration: the extended model that a diagnosis fitted, pressed by the machine.

It is not a truth: it contains what was fitted and nothing else, and every recording of it says so (``is_twin``). This
is the one module here that uses the fitted models; only the very data it was fitted to may be judged against it. *Left
out:* everything that the fit did not name, above all noise; the crosshead's share of the tube is Boyle's for the
pressure that is shown, sensor faults included.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from smartshoe.arrays import Array
from smartshoe.calibration import Calibration
from smartshoe.devices import Bladder
from smartshoe.errors import InputError, UsageError
from smartshoe.models.twin import TwinBladder

AMBIENT_PA = 101_325.0


class TwinParameters:
    """The scale of a bladder, which a machine needs before it presses it."""

    def __init__(self, bladder: TwinBladder) -> None:
        self.effective_area_m2 = bladder.effective_area_m2
        self.static_gain_pa_per_n = bladder.static_gain_pa_per_n
        self.full_scale_n = bladder.model.full_scale_load_n

    def nominal_pressure_pa(self, load_n: float) -> float:
        """Gauge pressure expected under a held load, without effects."""
        return self.static_gain_pa_per_n * load_n


class SimulatedTwin(Bladder):
    """`smartshoe.models.twin.TwinBladder` with the attributes that a simulated machine reads from a specimen."""

    def __init__(self, bladder: TwinBladder, source: str) -> None:
        self._bladder = bladder
        self.parameters = TwinParameters(bladder)
        self.metadata = {"is_twin": f"yes: simulated from the calibration {source}, not from physics of its own"}
        self.reset()

    def reset(self) -> None:
        """Return to rest."""
        self._bladder.reset()
        self.deformation = np.zeros(0)

    def press(self, load_n: Array, sample_rate_hz: float) -> Array:
        """Gauge pressure (n,) in Pa under ``load_n`` (n,) in N; see `TwinBladder.press`.

        Afterwards ``deformation`` (n,) holds the compressed share of the volume.
        """
        pressure_pa = self._bladder.press(load_n, sample_rate_hz)
        self.deformation = pressure_pa / np.maximum(pressure_pa + AMBIENT_PA, 0.1 * AMBIENT_PA)
        return pressure_pa


def twin_of(path: str | Path) -> SimulatedTwin:
    """The twin of the unit that the calibration at ``path`` describes.

    Raises `InputError` naming the file where it is no calibration, or where its reading is not a pressure.
    """
    try:
        return SimulatedTwin(TwinBladder(Calibration.load(path).model()), Path(path).name)
    except UsageError as error:
        raise InputError(f"{path}: {error}") from error
