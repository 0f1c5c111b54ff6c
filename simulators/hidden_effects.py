"""The registry of what can be hidden: each effect's family, stage, parameter, and how a truth is given it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from simulators.bladder import X_OVER_NRT
from simulators.presets import effective_area_m2

SHARE_OF_RANGE = 0.7  # of the sensor's range at full-scale load: room for effects that raise the reading

Options = dict[str, Any]
Draws = dict[str, float]


def merged(*options: Options) -> Options:
    """Nested tables laid over each other, the later ones on top."""
    whole: Options = {}
    for option in options:
        for key, value in option.items():
            both = isinstance(value, dict) and isinstance(whole.get(key), dict)
            whole[key] = merged(whole[key], value) if both else value
    return whole


@dataclass(frozen=True)
class Subject:
    """The unit that is given effects: its plain options, at a sensor's range."""

    name: str
    k1: float
    k2: float
    c: float
    range_mbar: float
    duration_s: float = 100.0

    @property
    def full_scale_mbar(self) -> float:
        """Reading at full-scale load."""
        return SHARE_OF_RANGE * self.range_mbar

    @property
    def effective_area_m2(self) -> float:
        """The area that puts full-scale load there."""
        return effective_area_m2(self.k1, SHARE_OF_RANGE / 0.85 * self.range_mbar * 100.0)

    @property
    def time_constant_s(self) -> float:
        """Of the pressure's own relaxation under a held load (eq. 2-4 of Chinimilli 2016)."""
        K1, K2 = self.k1 * X_OVER_NRT, self.k2 * X_OVER_NRT
        return self.c / self.k2 * (1.0 + K1 + K2) / (1.0 + K1)

    def options(self) -> Options:
        """Machine options of the plain unit, without noise; converter and load channel leave room for its effects."""
        return {
            "unit": self.name,
            "bladder": {"k1": self.k1, "k2": self.k2, "c": self.c, "effective_area_m2": self.effective_area_m2},
            "sensor": {
                "range_mbar": self.range_mbar,
                "noise_percent": 0.0,
                "over_range_percent": 12.5,
                "lag_s": 1e-4,
                "bidirectional": True,
            },
            "daq": {"bits": 14, "load_zero_v": 1.0, "load_full_scale_n": 1250.0},
        }


@dataclass(frozen=True)
class Hideable:
    """One effect.

    ``options(amount, draws, subject)`` are the machine options that switch it on, ``amount`` from 0 (nothing) to
    ``largest`` in ``unit``; ``draw`` draws its further parameters. ``truth`` names the catalogue's parameters from
    the same. ``needs_zero``: only a baseline without a constant sees it.
    """

    name: str
    family: str
    stage: str
    parameter: str
    unit: str
    typical: float
    largest: float
    options: Callable[[float, Draws, Subject], Options]
    draw: Callable[[np.random.Generator, Subject], Draws] = lambda rng, subject: {}
    inside: bool = True
    needs_zero: bool = False


def _uniform(**bounds: tuple[float, float]) -> Callable[[np.random.Generator, Subject], Draws]:
    return lambda rng, subject: {name: float(rng.uniform(*b)) for name, b in bounds.items()}


def _log(**bounds: tuple[float, float]) -> Callable[[np.random.Generator, Subject], Draws]:
    return lambda rng, subject: {
        name: float(np.exp(rng.uniform(np.log(b[0]), np.log(b[1])))) for name, b in bounds.items()
    }


def _signed(
    more: Callable[[np.random.Generator, Subject], Draws] = lambda rng, subject: {},
) -> Callable[[np.random.Generator, Subject], Draws]:
    def draw(rng: np.random.Generator, subject: Subject) -> Draws:
        return {"sign": float(rng.choice([-1.0, 1.0])), **more(rng, subject)}

    return draw


def _bladder(**given: Any) -> Options:
    return {"bladder": given}


def _sensor(**given: Any) -> Options:
    return {"sensor": given}


def _reading(**given: Any) -> Options:
    return {"daq": {"reading": given}}


def _odd(**given: Any) -> Options:
    return {"bladder": {"odd": given}}


def _second_time_constant(rng: np.random.Generator, subject: Subject) -> Draws:
    ratio = float(np.exp(rng.uniform(np.log(4.0), np.log(10.0))))
    slower = rng.random() < 0.4
    return {"time_constant_s": subject.time_constant_s * ratio if slower else subject.time_constant_s / ratio}


def _by_temperature(rng: np.random.Generator, subject: Subject) -> Draws:
    return {"sign": float(rng.choice([-1.0, 1.0])), "by_temperature": float(rng.random() < 0.4)}


PER_KELVIN = 50.0  # a coefficient per kelvin for one per second: warming is slow
ROOM = {"logged": True, "warming_k": 4.0, "warming_time_constant_s": 90.0, "swing_k": 1.0, "swing_period_s": 83.0}


def _gain_drift(amount: float, draws: Draws, subject: Subject) -> Options:
    size = draws["sign"] * amount
    if draws["by_temperature"]:
        return {"sensor": {"drift": {"gain_percent_per_k": PER_KELVIN * size}}, "room": ROOM}
    return _sensor(drift={"gain_percent_per_s": size})


def _zero_drift(amount: float, draws: Draws, subject: Subject) -> Options:
    size = draws["sign"] * amount
    if draws["by_temperature"]:
        return {"sensor": {"drift": {"zero_percent_per_k": PER_KELVIN * size}}, "room": ROOM}
    return _sensor(zero_drift_mbar_per_s=0.01 * size * subject.range_mbar)


def _gas_compression(amount: float, draws: Draws, subject: Subject) -> Options:
    area = replace(subject, range_mbar=amount).effective_area_m2
    return {"bladder": {"gas": "boyle", "effective_area_m2": area}, "sensor": {"range_mbar": amount}}


def _nonlinearity(amount: float, draws: Draws, subject: Subject) -> Options:
    if draws["odd"]:
        return _sensor(curve={"compression": amount})
    return _sensor(curve={"bridge": amount if draws["sign"] > 0 else -amount / (1.0 + amount)})


def _cross_talk(amount: float, draws: Draws, subject: Subject) -> Options:
    highest = {"highest_mbar": subject.full_scale_mbar, "noise_mbar": 0.001 * subject.full_scale_mbar}
    return {"neighbour": {"logged": True, "cross_talk": amount, "period_s": draws["period_s"], **highest}}


def saturation_level(amount: float, draws: Draws) -> float:
    """Where it begins, as a share of the full-scale reading; a soft knee bends before it is reached."""
    return (1.3 if draws["soft"] else 1.0) - amount


def _saturation(amount: float, draws: Draws, subject: Subject) -> Options:
    limit = 100.0 * SHARE_OF_RANGE * saturation_level(amount, draws)
    return _sensor(limit={"highest_percent": limit, "softness": 0.06 if draws["soft"] else 0.0})


def _heat_draws(rng: np.random.Generator, subject: Subject) -> Draws:
    return {"time_constant_s": float(np.exp(rng.uniform(np.log(0.4), np.log(3.0))))}


_HIDEABLE = [
    Hideable("second_relaxation", "relaxation", "wall", "k3", "N/m", 0.1, 20.0,
        lambda a, d, s: _bladder(second_relaxation={"k3": a, "time_constant_s": d["time_constant_s"]}),
        _second_time_constant),
    Hideable("power_law_creep", "relaxation", "wall", "stiffness", "N/m", 0.2, 20.0,
        lambda a, d, s: _bladder(power_law_creep={"stiffness": a, "exponent": d["exponent"]}),
        _uniform(exponent=(0.12, 0.45))),
    Hideable("linear_leak", "leak", "gas", "capillary_per_s", "1/s", 0.003, 0.5,
        lambda a, d, s: _bladder(leak={"capillary_per_s": a})),
    Hideable("orifice_leak", "leak", "gas", "nozzle_per_s", "1/s", 0.0005, 0.2,
        lambda a, d, s: _bladder(leak={"nozzle_per_s": a})),
    Hideable("gas_heat", "gas_heat", "gas", "fraction", "1", 0.1, 1.0,
        lambda a, d, s: _bladder(gas_heat={"fraction": a, "time_constant_s": d["time_constant_s"], "modes": 3}),
        _heat_draws),
    Hideable("gas_compression", "static_curve", "gas", "range", "mbar", 100.0, 1300.0, _gas_compression),
    Hideable("wall_hardening", "static_curve", "wall", "wall_stiffening", "1", 0.5, 6.0,
        lambda a, d, s: _bladder(wall_stiffening=a)),
    Hideable("contact_area", "static_curve", "contact", "saturation", "1", 0.05, 5.0,
        lambda a, d, s: _bladder(contact={"saturation": a})),
    Hideable("sensor_nonlinearity", "static_curve", "sensor", "bridge or compression", "1", 0.1, 6.0, _nonlinearity,
        lambda r, s: {"odd": float(r.random() < 0.4), "sign": float(r.choice([-1.0, 1.0]))}),
    Hideable("dead_band", "dead_band", "contact", "gap", "N", 10.0, 400.0,
        lambda a, d, s: _bladder(contact={"gap_n": a, "gap_spread": d["gap_spread"]}), _uniform(gap_spread=(0.2, 0.6))),
    Hideable("play_hysteresis", "hysteresis", "wall", "strength", "1", 0.01, 0.4,
        lambda a, d, s: _bladder(stick_slip={"strength": a, **d}),
        _log(first_slip=(0.005, 0.02), last_slip=(0.1, 0.3))),
    Hideable("bouc_wen_hysteresis", "hysteresis", "wall", "strength", "1", 0.01, 0.4,
        lambda a, d, s: _bladder(bouc_wen={"strength": a, **d}),
        _uniform(width=(0.05, 0.25), exponent=(1.0, 2.5), gamma=(0.1, 0.5))),
    Hideable("load_unload_asymmetry", "asymmetry", "wall", "direction_gain", "1", 0.01, 0.59,
        lambda a, d, s: _bladder(contact={"direction_gain": d["sign"] * a, "direction_turn_n": d["direction_turn_n"]}),
        _signed(_uniform(direction_turn_n=(3.0, 10.0)))),
    Hideable("rate_gain", "rate", "wall", "rate_gain", "1", 0.02, 1.9,
        lambda a, d, s: _bladder(contact={"rate_gain": a})),
    Hideable("mullins_softening", "softening", "wall", "strength", "1", 0.05, 0.95,
        lambda a, d, s: _bladder(softening={"strength": a, "width": d["width"]}), _uniform(width=(0.2, 0.5))),
    Hideable("cycle_conditioning", "softening", "wall", "gain", "1", 0.01, 0.49,
        lambda a, d, s: _bladder(conditioning={"gain": d["sign"] * a, "cycles": d["cycles"]}),
        _signed(_uniform(cycles=(2.0, 6.0)))),
    Hideable("gain_drift", "gain_drift", "sensor", "gain drift", "%/s", 0.005, 2.0, _gain_drift, _by_temperature),
    Hideable("sensor_lag", "timing", "sensor", "second_lag_s", "s", 0.02, 2.0,
        lambda a, d, s: _sensor(second_lag_s=a)),
    Hideable("delay", "timing", "logger", "delay_s", "s", 0.01, 5.0, lambda a, d, s: _reading(delay_s=a)),
    Hideable("clock_drift", "timing", "logger", "skew", "s/s", 1e-4, 0.09,
        lambda a, d, s: _reading(skew=-d["sign"] * a), _signed()),
    Hideable("zero_offset", "zero", "sensor", "zero_offset", "mbar", 0.5, 100.0,
        lambda a, d, s: _sensor(zero_offset_mbar=d["sign"] * a), _signed(), needs_zero=True),
    Hideable("zero_drift", "zero", "sensor", "zero drift", "%/s", 0.005, 2.0, _zero_drift, _by_temperature),
    Hideable("warm_up", "zero", "sensor", "warm_up", "%", 0.5, 40.0,
        lambda a, d, s: _sensor(drift={"warm_up_percent": d["sign"] * a,
                                       "warm_up_time_constant_s": d["warm_up_time_constant_s"]}),
        _signed(_log(warm_up_time_constant_s=(20.0, 90.0)))),
    Hideable("permanent_set", "zero", "wall", "rate_per_s", "1/s", 2e-4, 0.1,
        lambda a, d, s: _bladder(permanent_set={"rate_per_s": a})),
    Hideable("saturation", "saturation", "sensor", "share of full scale cut off", "1", 0.1, 0.9, _saturation,
        lambda r, s: {"soft": float(r.random() < 0.25)}),
    Hideable("cross_talk", "cross_talk", "sensor", "cross_talk", "1", 0.01, 1.0, _cross_talk,
        _uniform(period_s=(2.0, 5.0))),
    Hideable("load_cell_tare", "tare", "machine", "load_cell_tare", "N", 5.0, 150.0,
        lambda a, d, s: {"load_cell_tare_n": d["sign"] * a}, _signed(), needs_zero=True),
    Hideable("hum", "noise", "logger", "hum", "%", 0.5, 30.0,
        lambda a, d, s: _reading(hum_percent=a, hum_hz=d["hum_hz"]),
        lambda r, s: {"hum_hz": float(r.choice([50.0, 60.0]) + r.uniform(0.01, 0.05) * r.choice([-1.0, 1.0]))}),
    Hideable("coloured_noise", "noise", "sensor", "coloured", "%", 0.5, 30.0,
        lambda a, d, s: _sensor(noise={"coloured_percent": a, **d}), _log(coloured_time_constant_s=(0.1, 3.0))),
    Hideable("heteroscedastic_noise", "noise", "sensor", "growing", "%", 0.5, 50.0,
        lambda a, d, s: _sensor(noise={"growing_percent": a})),
    Hideable("timing_jitter", "noise", "logger", "jitter_s", "s", 0.005, 1.0, lambda a, d, s: _reading(jitter_s=a)),
    Hideable("spikes", "noise", "logger", "spike size", "%", 20.0, 90.0,
        lambda a, d, s: _reading(spike_percent=a, spike_share=d["spike_share"]), _log(spike_share=(2e-3, 1e-2))),
    Hideable("quantisation", "data", "logger", "lattice", "%", 1.0, 40.0,
        lambda a, d, s: _reading(lattice_percent=a)),
    Hideable("held_samples", "data", "logger", "held_share", "1", 0.1, 0.9,
        lambda a, d, s: _reading(held_share=a, held_run=d["held_run"]), _uniform(held_run=(2.0, 6.0))),
    Hideable("dropouts", "data", "logger", "dropout_share", "1", 0.002, 0.2,
        lambda a, d, s: _reading(dropout_share=a, dropout_run=d["dropout_run"]), _uniform(dropout_run=(2.0, 8.0))),
    Hideable("gain_step", "outside", "sensor", "gain step", "%", 2.0, 60.0,
        lambda a, d, s: _sensor(wander={"gain_step_percent": d["sign"] * a, "gain_step_at_s": d["gain_step_at_s"]}),
        _signed(lambda r, s: {"gain_step_at_s": float(r.uniform(0.25, 0.75)) * s.duration_s}), inside=False),
    Hideable("resonance", "outside", "contact", "resonance", "1", 0.2, 1.0,
        lambda a, d, s: _odd(resonance=a, resonance_hz=d["resonance_hz"], resonance_damping=d["resonance_damping"]),
        _log(resonance_hz=(0.3, 3.0), resonance_damping=(0.01, 0.06)), inside=False),
    Hideable("slow_sine", "outside", "sensor", "slow sine", "%", 1.0, 40.0,
        lambda a, d, s: _sensor(wander={"slow_sine_percent": a, **d}),
        _uniform(slow_sine_period_s=(15.0, 60.0), slow_sine_phase=(0.0, 1.0)), inside=False),
    Hideable("telegraph_noise", "outside", "sensor", "telegraph", "%", 1.0, 40.0,
        lambda a, d, s: _sensor(wander={"telegraph_percent": a, **d}), _log(telegraph_dwell_s=(1.0, 8.0)),
        inside=False),
    Hideable("intermittent_pinch", "outside", "contact", "pinch", "1", 0.05, 1.0,
        lambda a, d, s: _odd(pinch=a, pinch_from=d["pinch_from"], pinch_share=d["pinch_share"], seed=int(d["seed"])),
        lambda r, s: {"pinch_from": float(r.uniform(0.1, 0.5)), "pinch_share": float(r.uniform(0.3, 0.6)),
                      "seed": float(r.integers(2**31))}, inside=False),
    Hideable("random_seating", "outside", "contact", "seating", "1", 0.02, 0.3,
        lambda a, d, s: _odd(seating=a, seed=int(d["seed"])), lambda r, s: {"seed": float(r.integers(2**31))},
        inside=False),
    Hideable("snap_through", "outside", "wall", "snap", "1", 0.02, 0.5,
        lambda a, d, s: _odd(snap=a, **d), _uniform(snap_up=(0.5, 0.8), snap_down=(0.15, 0.4)), inside=False),
    Hideable("draughts", "outside", "sensor", "draught", "%", 2.0, 40.0,
        lambda a, d, s: _sensor(wander={"draught_percent": a, **d}),
        _uniform(draught_every_s=(15.0, 40.0), draught_recovery_s=(2.0, 8.0)), inside=False),
]  # fmt: skip

EFFECTS: dict[str, Hideable] = {effect.name: effect for effect in _HIDEABLE}
