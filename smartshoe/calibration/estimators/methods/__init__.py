"""The estimators of force: each is a module of this folder named like the estimator, with the class as ``ESTIMATOR``.

Other packages offer theirs by the entry-point group ``smartshoe.estimators`` (docs/extending.md).
"""

from __future__ import annotations

import importlib
import pkgutil
from importlib.metadata import EntryPoint, entry_points
from typing import TYPE_CHECKING, Any

from smartshoe.errors import UsageError

if TYPE_CHECKING:
    from smartshoe.calibration._calibration import Calibration
    from smartshoe.calibration.estimators._estimate import Estimator

GROUP = "smartshoe.estimators"


def estimator_names() -> tuple[str, ...]:
    """The names of all estimators, in their order, without importing any."""
    return tuple(sorted({*_own(), *_installed()}))


def estimator(
    name: str, calibration: Calibration, sample_rate_hz: float | None = None, *, noise_sd: float | None = None
) -> Estimator:
    """The estimator ``name`` for a unit's ``calibration``.

    Parameters
    ----------
    name : str
        ``static`` is b1/a1 (reading - offset); ``lead`` the paper's filter; ``inverse`` that of the extended model;
        ``kalman``, ``smoother`` and ``imm`` are of the linear part, with a variance that follows the load; or one that
        an installed package offers.
    calibration : Calibration
        The unit's.
    sample_rate_hz : float, optional
        Of the readings; the calibration's own where None.
    noise_sd : float, optional
        Of the reading, in its unit; found from the readings where None.

    Raises
    ------
    UsageError
        For another name, for a rate of 0 or less, for ``inverse`` where the calibration has no extended model.

    Examples
    --------
    >>> from smartshoe.calibration import Calibration
    >>> from smartshoe.units import MILLIBAR
    >>> heel = Calibration(a1=0.2, b0=5.0, b1=1.1, reading_unit=MILLIBAR, unit="left_heel")
    >>> found = estimator("static", heel, 100.0, noise_sd=0.1).estimate([10.0, 20.0])
    >>> found.force_n.round(3).tolist(), found.sd_n.round(3).tolist()  # N
    ([55.0, 110.0], [0.55, 0.55])
    """
    require_known(name)
    rate_hz = calibration.sample_rate_hz if sample_rate_hz is None else sample_rate_hz
    if not rate_hz > 0.0:
        raise UsageError(f"sample_rate_hz is {rate_hz:g}: give a rate above 0 Hz")
    kind = _loaded(_installed()[name]) if name not in _own() else _module(name).ESTIMATOR
    made: Estimator = kind(calibration, rate_hz, noise_sd=noise_sd)
    return made


def require_known(name: str) -> None:
    """Raise `UsageError` for a name that belongs to no estimator."""
    if name not in estimator_names():
        raise UsageError(f"estimator {name!r} is not known: use one of {', '.join(estimator_names())}")


def _own() -> set[str]:
    return {module.name for module in pkgutil.iter_modules(__path__)}


def _module(name: str) -> Any:
    return importlib.import_module(f"{__name__}.{name}")


def _installed() -> dict[str, EntryPoint]:
    return {entry.name: entry for entry in entry_points(group=GROUP)}


def _loaded(entry: EntryPoint) -> Any:
    from smartshoe.calibration.estimators._estimate import Estimator

    try:
        kind = entry.load()
    except Exception as error:  # another package may raise anything
        raise UsageError(
            f"the estimator {entry.name} ({entry.value}) cannot be loaded ({error}): update or remove its package"
        ) from error
    if not (isinstance(kind, type) and issubclass(kind, Estimator)):
        raise UsageError(
            f"the estimator {entry.name} ({entry.value}) is no class of smartshoe.calibration.estimators.Estimator:"
            " update its package"
        )
    return kind
