"""A unit's extended model as a bladder: what the next simulation of this very unit presses."""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array, require_positive
from smartshoe.devices import Bladder
from smartshoe.errors import UsageError
from smartshoe.models.effects.effect import Conditions
from smartshoe.models.extended import ExtendedModel
from smartshoe.units import find_unit


class TwinBladder(Bladder):
    """An `ExtendedModel` under load, its whole chain included: sensor and logger effects come out as pressure.

    So the sensor and logger that read it should be nominal ones, or their faults count twice. It is no truth: it knows
    what was fitted and nothing else. Effects of a temperature or of a neighbour are inert, noise is left out.

    Memory carries on from one `press` to the next by running the chain anew over all loads since `reset`, so that a
    thousand short presses cost a thousand times a long one. Effects that look ahead (a delay's interpolation, the
    window of a rate) see up to eight samples fewer at the end of a press than in one long press.
    Raises `UsageError` for a model whose reading is no pressure.
    """

    def __init__(self, model: ExtendedModel) -> None:
        unit = find_unit(model.reading_unit)
        if unit is None or unit.quantity != "pressure":
            raise UsageError(
                f"the model's reading is in {model.reading_unit}, not a pressure: a bladder can be made of a unit that"
                " was calibrated in mbar, Pa, kPa, bar or the like"
            )
        self.model = model
        self._unit = unit
        self.reset()

    @property
    def static_gain_pa_per_n(self) -> float:
        """Gauge pressure in Pa per newton of a held load, without effects."""
        reading = self.model.gain * self.model.full_scale_reading
        return reading * self._unit.scale / self.model.full_scale_load_n

    @property
    def effective_area_m2(self) -> float:
        """1/(static gain N), the area that stands between load and stress in the paper's eq. (2)."""
        return 1.0 / (self.static_gain_pa_per_n * self.model.wall_ratio)

    def reset(self) -> None:
        """Back to rest: unloaded, in steady state, memory forgotten, the session's time at zero."""
        self._load_n = np.zeros(1)
        self._rate_hz: float | None = None

    def press(self, load_n: Array, sample_rate_hz: float) -> Array:
        """Gauge pressure (n,) in Pa under ``load_n`` (n,) in N, compression positive; memory carries on.

        The load is linear between samples, and from the last sample of the call before (or rest) to the first. Raises
        `UsageError` where a load is not finite, and where the rate changes between two resets.
        """
        load = np.asarray(load_n, dtype=float)
        if not np.isfinite(load).all():
            at = int(np.argmin(np.isfinite(load)))
            raise UsageError(f"load sample {at + 1} of {load.size} is not finite: fill gaps before pressing")
        sample_rate_hz = require_positive(sample_rate_hz, "sample_rate_hz")
        if self._rate_hz is not None and sample_rate_hz != self._rate_hz:
            raise UsageError(
                f"the twin was pressed at {self._rate_hz:g} Hz since its reset, now at {sample_rate_hz:g} Hz: keep to"
                " one rate or reset it"
            )
        self._rate_hz = float(sample_rate_hz)
        if not load.size:
            return np.zeros(0)
        self._load_n = np.concatenate([self._load_n, load])
        step_s = 1.0 / self._rate_hz
        time_s: Array = np.arange(self._load_n.size, dtype=float) * step_s
        conditions = Conditions(time_s, self._load_n / self.model.full_scale_load_n, step_s)
        return self._unit.to_si(self.model.reading(conditions)[-load.size :])
