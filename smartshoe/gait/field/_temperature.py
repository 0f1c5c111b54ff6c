"""Temperature: sealed air that warms raises the pressure as a load does.

From p V = n R T at constant n and V, dp/dT = p/T.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from smartshoe.errors import UsageError
from smartshoe.gait.field._finding import CheckResult, Verdict

ATMOSPHERE_PA = 101_325.0
ROOM_K = 295.0
AGREE_CHANCE = 0.01
LARGE_K = 3.0  # about 10 mbar, 5 % of a 200 mbar range
FIXED_SHARE = 0.10  # of the change: how far sealed units differ, since walls give way and lines differ


def sealed_air_pa_per_k(absolute_pressure_pa: float = ATMOSPHERE_PA, temperature_k: float = ROOM_K) -> float:
    """Rise of pressure in Pa per K of air sealed in a constant volume: p/T."""
    if not (absolute_pressure_pa > 0.0 and temperature_k > 0.0):
        raise UsageError(f"{absolute_pressure_pa:g} Pa at {temperature_k:g} K is no state of air: give both above 0")
    return absolute_pressure_pa / temperature_k


def temperature_of_zeros(
    changes_pa: ArrayLike,
    sd_pa: ArrayLike,
    names: Sequence[str],
    *,
    absolute_pressure_pa: float = ATMOSPHERE_PA,
    temperature_k: float = ROOM_K,
    when: str = "",
) -> CheckResult:
    """The warming that would cause the changes ``changes_pa`` (units,) of the zeros, with sd ``sd_pa``, in sealed air.

    Warm air raises all sealed units alike. Units that differ by more than their sd (and a tenth of the change, for
    walls and lines) have a cause of their own: a leak, a load, a sensor. The verdict is then "unknown" and the unit
    furthest off is named. ``when`` ("at the start: ") begins the sentence. ``numbers``: delta_k, sd_k, change_pa,
    p_value.
    """
    changes = np.atleast_1d(np.asarray(changes_pa, dtype=float))
    sds = np.broadcast_to(np.asarray(sd_pa, dtype=float), changes.shape)
    if changes.shape != (len(names),) or not np.isfinite(changes).all() or not (sds > 0.0).all():
        raise UsageError(
            f"changes of {changes.size} units for {len(names)} names: give one finite change a unit, sd above 0"
        )
    from scipy.stats import chi2

    per_k = sealed_air_pa_per_k(absolute_pressure_pa, temperature_k)
    spread = np.hypot(sds, FIXED_SHARE * float(np.abs(np.median(changes))))
    weight = spread**-2.0
    change = float(np.sum(weight * changes) / weight.sum())
    distance = float(np.sum(weight * (changes - change) ** 2))
    p_value = float(chi2.sf(distance, changes.size - 1)) if changes.size > 1 else 1.0
    delta_k, sd_k = change / per_k, float(weight.sum() ** -0.5) / per_k
    numbers = {"delta_k": delta_k, "sd_k": sd_k, "change_pa": change, "p_value": p_value}
    if p_value < AGREE_CHANCE:
        furthest = int(np.argmax(np.abs(changes - np.median(changes)) / spread))
        says = (
            f"{when}the zeros have moved apart, {names[furthest]} by {changes[furthest] / 100:.3g} mbar against"
            f" {np.median(changes) / 100:.3g} mbar: warm air moves all alike, look for a leak or a load there"
        )
        return CheckResult("temperature", "unknown", says, names[furthest], None, numbers)
    if abs(delta_k) <= 2.0 * sd_k:
        says = f"{when}no warming shows in the zeros ({delta_k:.2g} K, sd {sd_k:.1g})"
        return CheckResult("temperature", "ok", says, "", None, numbers)
    verdict: Verdict = "warning" if abs(delta_k) > LARGE_K else "ok"
    says = (
        f"{when}the zeros have moved together by {change / 100:.3g} mbar, as sealed air does that"
        f" {'warms' if change >= 0.0 else 'cools'} by {abs(delta_k):.2g} K (sd {sd_k:.1g})"
    )
    ending = ": zero again before use" if verdict == "warning" else ""
    return CheckResult("temperature", verdict, says + ending, "", None, numbers)


def temperature_sensitivity(
    temperature_k: ArrayLike,
    zeros_pa: ArrayLike,
    *,
    absolute_pressure_pa: float = ATMOSPHERE_PA,
) -> CheckResult:
    """How a unit's ``zeros_pa`` (n,) follow a measured ``temperature_k`` (n,), compared with p/T of sealed air.

    ``numbers``: pa_per_k with low and high (95 %), sealed_pa_per_k, and the ratio as share. A share near 1 means a
    sealed rigid tube; well below 1, one that gives way or leaks. The verdict is "unknown" if the temperature hardly
    changed.
    """
    warm, zeros = np.asarray(temperature_k, dtype=float), np.asarray(zeros_pa, dtype=float)
    if warm.shape != zeros.shape or warm.ndim != 1 or warm.size < 3:
        raise UsageError("give a temperature and a zero a moment, three moments at least")
    if float(np.ptp(warm)) < 0.5:
        says = f"the temperature moved by {float(np.ptp(warm)):.2g} K only: what it does to the zero is not known"
        return CheckResult("temperature_sensitivity", "unknown", says)
    from scipy.stats import linregress, t

    line = linregress(warm, zeros)
    half = float(t.ppf(0.975, warm.size - 2)) * float(line.stderr)
    sealed = sealed_air_pa_per_k(absolute_pressure_pa, float(warm.mean()))
    slope = float(line.slope)
    numbers = {
        "pa_per_k": slope, "low_pa_per_k": slope - half, "high_pa_per_k": slope + half, "sealed_pa_per_k": sealed,
        "share": slope / sealed,
    }  # fmt: skip
    range_ = f"({(slope - half) / 100:.3g} to {(slope + half) / 100:.3g})" if math.isfinite(half) else ""
    says = (
        f"the zero follows the temperature with {slope / 100:.3g} mbar/K {range_},"
        f" {100 * slope / sealed:.2g} % of sealed air's {sealed / 100:.3g} mbar/K"
    )
    return CheckResult("temperature_sensitivity", "ok", says, "", None, numbers)
