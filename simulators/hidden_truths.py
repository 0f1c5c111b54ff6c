"""What an equation of the catalogue would have for parameters, had it made a hidden case: to score a diagnosis by.

Names are the catalogue's own words with the unit behind (no unit: a share); only what compares is given.
"""

from __future__ import annotations

from collections.abc import Mapping

from simulators.bladder import AMBIENT_PA, HEAT_RATIO, X_OVER_NRT
from simulators.effects.sensing import DIE_FASTER, DIE_SHARE
from simulators.hidden_effects import PER_KELVIN, SHARE_OF_RANGE, Draws, Subject, saturation_level
from simulators.presets import FULL_SCALE_N

AMBIENT_MBAR = AMBIENT_PA / 100.0


def alias_hz(frequency_hz: float, sample_rate_hz: float) -> float:
    """Where a tone of ``frequency_hz`` comes out in a log at ``sample_rate_hz``."""
    folded = frequency_hz % sample_rate_hz
    return min(folded, sample_rate_hz - folded)


def catalogue_parameters(
    name: str, amount: float, draws: Draws, subject: Subject, sample_rate_hz: float
) -> Mapping[str, float]:
    """The catalogue's parameters of the effect ``name`` at ``amount``; empty where none compares."""
    sign = draws.get("sign", 1.0)
    K1 = subject.k1 * X_OVER_NRT
    mbar_per_percent = 0.01 * subject.range_mbar
    by_temperature = draws.get("by_temperature", 0.0) > 0
    match name:
        case "second_relaxation":
            return {"share": amount * X_OVER_NRT / (1.0 + K1), "time_constant_s": draws["time_constant_s"]}
        case "power_law_creep":
            return {"exponent": draws["exponent"]}
        case "linear_leak":
            return {"leak_rate_per_s": amount}
        case "gas_heat":
            share = (HEAT_RATIO - 1.0) * amount
            return {"share": share, "time_constant_s": draws["time_constant_s"]}
        case "gas_compression":
            return {"pressure_ratio": SHARE_OF_RANGE * amount / AMBIENT_MBAR}
        case "dead_band":
            return {"lost_load_n": amount}
        case "play_hysteresis" | "bouc_wen_hysteresis":
            return {"half_height_n": FULL_SCALE_N * amount}
        case "load_unload_asymmetry":
            return {"lost_gain": sign * amount}
        case "rate_gain":
            return {"gain_per_rate": amount}  # at full scale a second
        case "cycle_conditioning":
            return {"gained": sign * amount, "cycles": draws["cycles"]}
        case "gain_drift" if by_temperature:
            return {"temperature_coefficient_per_k": 0.01 * PER_KELVIN * sign * amount}
        case "gain_drift":
            return {"drift_rate_per_s": 0.01 * sign * amount}
        case "sensor_lag":
            # Two poles, at the time constant and at a quarter of it, delay a ramp by their sum.
            return {"time_constant_s": 1.25 * amount}
        case "delay":
            return {"delay_s": amount}
        case "clock_drift":
            return {"clock_rate_error": sign * amount}
        case "zero_offset":
            return {"offset_mbar": sign * amount}
        case "zero_drift" if by_temperature:
            return {"temperature_coefficient_mbar_per_k": PER_KELVIN * sign * amount * mbar_per_percent}
        case "zero_drift":
            return {"drift_rate_mbar_per_s": sign * amount * mbar_per_percent}
        case "warm_up":
            mean = 1.0 - DIE_SHARE + DIE_SHARE / DIE_FASTER
            return {
                "change_mbar": sign * amount * mbar_per_percent,
                "time_constant_s": mean * draws["warm_up_time_constant_s"],
            }
        case "permanent_set":
            return {"set_rate_mbar_per_s": amount * K1 / (1.0 + K1) * subject.full_scale_mbar}
        case "saturation":
            return {"level_mbar": saturation_level(amount, draws) * subject.full_scale_mbar}
        case "cross_talk":
            return {"coupling_mbar": amount * subject.full_scale_mbar}  # at the neighbour's largest
        case "load_cell_tare":
            return {"tare_n": -sign * amount}  # acting load less measured load
        case "hum":
            return {"frequency_hz": alias_hz(draws["hum_hz"], sample_rate_hz)}
        case "timing_jitter":
            return {"jitter_s": amount}
        case "quantisation":
            return {"step_mbar": amount * mbar_per_percent}
        case "held_samples" | "dropouts":
            return {"share": amount}
        case "spikes":
            return {"share": draws["spike_share"], "size_mbar": amount * mbar_per_percent}
        case _:
            return {}
