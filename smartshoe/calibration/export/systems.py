"""A calibration's filter as an object of other libraries: `scipy.signal` and python-control."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from smartshoe.calibration._calibration import Calibration
from smartshoe.calibration.export._model import FilterModel
from smartshoe.errors import UsageError

if TYPE_CHECKING:
    from scipy.signal import TransferFunction


def scipy_system(
    calibration: Calibration, *, sample_rate_hz: float | None = None, continuous: bool = False
) -> TransferFunction:
    """Force in N over the reading less its offset, as a `scipy.signal` transfer function.

    Discrete at ``sample_rate_hz`` (by default the calibration's own), with the very numbers that the compensator runs;
    ``continuous`` gives (b0 s + b1)/(s + a1), Chinimilli 2016 (13). Of an extended calibration it is the linear part.
    """
    from scipy import signal

    numerator, denominator, step_s = _coefficients(calibration, sample_rate_hz, continuous)
    if step_s is None:
        return signal.TransferFunction(numerator, denominator)
    return signal.TransferFunction(numerator, denominator, dt=step_s)


def control_system(calibration: Calibration, *, sample_rate_hz: float | None = None, continuous: bool = False) -> Any:
    """The same as a `control.TransferFunction`, input ``reading``, output ``force``.

    Raises `UsageError` where python-control is not installed.
    """
    try:
        import control
    except ImportError as error:
        raise UsageError("python-control is not installed: pip install control, or use scipy_system") from error
    numerator, denominator, step_s = _coefficients(calibration, sample_rate_hz, continuous)
    return control.TransferFunction(
        numerator, denominator, 0 if step_s is None else step_s, inputs="reading", outputs="force"
    )


def _coefficients(
    calibration: Calibration, sample_rate_hz: float | None, continuous: bool
) -> tuple[list[float], list[float], float | None]:
    """Numerator and denominator, highest power first, and the time step in s (None: continuous)."""
    if continuous:
        if sample_rate_hz is not None:
            raise UsageError("a continuous system has no sample_rate_hz: leave one of the two away")
        return [calibration.b0, calibration.b1], [1.0, calibration.a1], None
    model = FilterModel.of(calibration, sample_rate_hz)
    return list(model.numerator), list(model.denominator), 1.0 / model.sample_rate_hz
