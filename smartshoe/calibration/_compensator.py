"""The paper's compensator: equation (13) under the bilinear transform, for whole signals and streams."""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array
from smartshoe.calibration._filter import ForceFilter
from smartshoe.errors import UsageError
from smartshoe.kernels.linear_filter import linear_filter
from smartshoe.models import discretise
from smartshoe.units import Unit


class Compensator(ForceFilter):
    """force = (b0 s + b1)/(s + a1) (reading - offset), Chinimilli 2016 (13), bilinear at ``sample_rate_hz``.

    Its start and its handling of missing readings and streams are those of `ForceFilter`.
    """

    def __init__(
        self,
        a1: float,
        b0: float,
        b1: float,
        *,
        offset: float = 0.0,
        sample_rate_hz: float = 100.0,
        reading_unit: Unit | None = None,
    ) -> None:
        self.numerator, self.denominator = discretise(a1, b0, b1, sample_rate_hz, "bilinear")
        if not np.isfinite(offset):
            raise UsageError(f"offset is {offset:g}: give a finite number")
        self.a1, self.b0, self.b1, self.offset = float(a1), float(b0), float(b1), float(offset)
        self.sample_rate_hz = float(sample_rate_hz)
        self.reading_unit = reading_unit
        self._static_gain = float(self.numerator.sum() / self.denominator.sum())
        self.reset()

    def reset(self) -> None:
        """Return to the initial state: the filter starts in the steady state of the next reading."""
        super().reset()
        self._state = np.zeros(1)

    def _copy(self) -> Compensator:
        return Compensator(
            self.a1,
            self.b0,
            self.b1,
            offset=self.offset,
            sample_rate_hz=self.sample_rate_hz,
            reading_unit=self.reading_unit,
        )

    def _column(self) -> list[float]:
        """The filter in its initial state as a column of a bank, in the order of `smartshoe.kernels.streaming`."""
        n0, n1 = self.numerator
        return [float(n0), float(n1), float(self.denominator[1]), self._static_gain, self.offset, 0.0, np.nan, 0.0]

    def _begin(self, first: float) -> None:
        # With y = n0 u + state, this state makes the first output that of the static gain.
        self._state = np.array([(self._static_gain - self.numerator[0]) * (first - self.offset)])

    def _advance(self, readings: Array, count: int) -> Array:
        force_n, self._state = linear_filter(self.numerator, self.denominator, readings - self.offset, self._state)
        return np.asarray(force_n)
