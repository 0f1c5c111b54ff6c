"""What a case of the bank is to hold, drawn from its kind and index: effects, laws, strengths, conditions.

======== ===========================================================================================================
single   one effect of the catalogue, each once in 35 cases, log-uniform from 0.05 to 5 % of full scale
two      two physical effects of families that do not imitate each other, 0.3 to 3 % each
three    three of them
alike    two physical effects of families that imitate each other, 0.3 to 3 % each
family   two physical effects of one family, of branches that may be there together, 0.3 to 3 % each
none     nothing but nuisances and conditions
outside  one effect that the catalogue does not have, 0.3 to 3 %
worlds   one physical effect: unit, machine, protocols, strength, nuisances and noise are the same in the cases 3k,
         3k + 1 and 3k + 2; only the law differs
======== ===========================================================================================================
"""

from __future__ import annotations

import zlib
from collections.abc import Set
from dataclasses import dataclass

import numpy as np

from simulators.hidden.effects import BY_LAW_ALONE, EFFECTS, Hideable
from smartshoe.errors import UsageError

KINDS = ("single", "two", "three", "alike", "family", "none", "outside", "worlds")
ALL = {**EFFECTS, **BY_LAW_ALONE}
INSIDE = tuple(name for name, effect in ALL.items() if effect.inside)
OUTSIDE = tuple(name for name, effect in ALL.items() if not effect.inside)
PHYSICAL = tuple(name for name in INSIDE if ALL[name].family not in ("noise", "data"))
LAWS = 3  # of each effect, in the rotation of `worlds`

# Families whose small amounts imitate each other: hidden together in `alike` only, and never used as nuisance.
IMITATE = {
    "zero": {"leak", "relaxation", "tare"}, "leak": {"zero", "relaxation"}, "tare": {"zero"},
    "relaxation": {"gas_heat", "zero", "leak"}, "gas_heat": {"relaxation", "rate", "timing"},
    "softening": {"gain_drift"}, "gain_drift": {"softening"}, "asymmetry": {"hysteresis"},
    "hysteresis": {"asymmetry", "relaxation"}, "rate": {"gas_heat"}, "dead_band": {"static_curve", "zero", "tare"},
    "static_curve": {"dead_band", "saturation"}, "saturation": {"static_curve"}, "timing": {"gas_heat"},
}  # fmt: skip
# Effects of one family that are nevertheless different things: both may be present.
ONE_FAMILY = (
    ("delay", "clock_drift"), ("delay", "sensor_lag"), ("clock_drift", "sensor_lag"), ("permanent_set", "warm_up"),
    ("permanent_set", "zero_drift"), ("mullins_softening", "cycle_conditioning"),
)  # fmt: skip
STRONGEST = {
    "second_relaxation": 0.8, "power_law_creep": 1.5, "gas_heat": 0.7, "gas_compression": 1.4, "sensor_lag": 0.7,
    "sensor_nonlinearity": 2.5, "held_samples": 1.0, "delay": 1.5, "rate_gain": 2.5, "linear_leak": 2.5,
    "orifice_leak": 2.5, "cycle_conditioning": 3.0, "mullins_softening": 3.0, "clock_drift": 2.5,
}  # fmt: skip
STRENGTHS = {
    "single": (0.05, 5.0), "worlds": (0.3, 2.0), "two": (0.3, 3.0), "three": (0.3, 2.5), "alike": (0.3, 3.0),
    "family": (0.3, 3.0), "outside": (0.3, 3.0),
}  # fmt: skip
MOST_DEPARTURE = 0.4

# Protocols that reveal an effect and distinguish it from similar ones; the first recording uses one of these.
SHOWN_BY: dict[str, tuple[str, ...]] = {
    "second_relaxation": ("holds", "recovery"), "power_law_creep": ("holds", "recovery"),
    "linear_leak": ("recovery",), "orifice_leak": ("recovery",), "permanent_set": ("recovery", "holds"),
    "gas_heat": ("holds", "step"), "dead_band": ("rates", "staircase"),
    "play_hysteresis": ("minor_loops",), "bouc_wen_hysteresis": ("minor_loops",),
    "load_unload_asymmetry": ("minor_loops", "mixed"), "rate_gain": ("rates", "mixed"),
    "mullins_softening": ("shuffled", "mixed"), "cycle_conditioning": ("shuffled", "walking"),
    "gain_drift": ("shuffled", "mixed"), "sensor_lag": ("multisine", "step", "walking"),
    "delay": ("multisine", "step", "walking"), "clock_drift": ("rates", "walking", "mixed"),
    "zero_drift": ("idle", "recovery"), "warm_up": ("idle", "recovery"), "zero_offset": ("holds", "staircase"),
    "load_cell_tare": ("staircase", "rates"), "cross_talk": ("holds", "recovery"),
}  # fmt: skip
# Approximate duration of each protocol.
LASTS_S = {
    "rates": 270.0, "shuffled": 230.0, "staircase": 240.0, "holds": 200.0, "mixed": 170.0, "walking": 100.0,
    "minor_loops": 110.0, "multisine": 135.0, "step": 80.0, "recovery": 290.0, "idle": 280.0, "single_rate": 135.0,
}  # fmt: skip
MOST_SAMPLES = 200_000
PLAIN = ("rates", "shuffled", "staircase", "holds", "mixed")
BESIDE = ("rates", "shuffled", "holds", "mixed", "staircase", "walking", "minor_loops")
# Effects that show in rests, or at the end of the range.
NEEDS_REST = frozenset({
    "dead_band", "zero_offset", "load_cell_tare", "permanent_set", "linear_leak", "orifice_leak", "mullins_softening",
})  # fmt: skip
NEEDS_RATES = frozenset({"relaxation", "rate", "timing", "gas_heat", "hysteresis"})


@dataclass(frozen=True)
class Plan:
    """The description of one case. ``laws`` and ``departures`` are in the order of ``effects``."""

    kind: str
    index: int
    seed: int
    effects: tuple[str, ...]
    laws: tuple[str, ...]
    asked_percent: tuple[float, ...]
    departures: tuple[float, ...]
    fitted: tuple[str, ...]
    held: tuple[str, ...]
    zero: str
    floor_n: float
    sample_rate_hz: float
    tare_n: float
    offset_share: float
    late_s: float
    law_seed: int
    logs_displacement: bool
    logs_command: bool

    @property
    def families(self) -> frozenset[str]:
        """The families of the effects, and those that imitate them."""
        return frozenset(_near({ALL[name].family for name in self.effects}))


def seeded(*key: object) -> int:
    """A seed that depends on all of ``key``."""
    return zlib.crc32(repr(key).encode())


def plan(kind: str, index: int) -> Plan:
    """Case ``index`` of ``kind``; reproducible. Raises `UsageError` for an unknown kind."""
    if kind not in KINDS or index < 0:
        raise UsageError(f"there is no case {index} of the kind {kind!r}: use 0 and up of one of {', '.join(KINDS)}")
    group = index // LAWS if kind == "worlds" else index
    seed = seeded("bank", kind, group)
    rng = np.random.default_rng([seed, 1])
    names = _names(kind, group, rng)
    low, high = STRENGTHS.get(kind, (1.0, 1.0))
    asked = tuple(_log(rng, low, min(high, STRONGEST.get(name, high))) for name in names)
    drawn = [int(rng.integers(len(_laws(ALL[name])))) for name in names]
    turn = index % LAWS if kind == "worlds" else None
    laws = tuple(
        _laws(ALL[n])[d if turn is None else turn % len(_laws(ALL[n]))] for n, d in zip(names, drawn, strict=True)
    )
    departures = tuple(float(rng.uniform(0.0, MOST_DEPARTURE)) for _ in names)
    fitted, held = _protocols(names, rng)
    families = {ALL[name].family for name in names}
    one_rate = rng.random() < 0.08 and not families & NEEDS_RATES and kind != "outside"
    if one_rate:
        fitted, held = ("single_rate",) * len(fitted), ("single_rate",)
    zero = str(rng.choice(["seen", "seen", "seen", "starts_loaded", "never_unloaded"]))
    if set(names) & NEEDS_REST:
        zero = "seen"
    rate = float(rng.choice([100.0, 100.0, 100.0, 49.0, 90.0, 200.0, 500.0, 1000.0]))
    # A long recording at a high rate would only be large.
    total_s = sum(LASTS_S.get(name, LASTS_S["rates"]) for name in (*fitted, *held)) + (
        0.0 if zero == "seen" else 60.0 * (len(fitted) + 1)
    )
    rate = rate if rate * total_s <= MOST_SAMPLES else 100.0
    near = _near(families)
    tare, offset, late = rng.random() < 0.3, rng.random() < 0.25, rng.random() < 0.25
    sizes = [_log(rng, 0.002, 0.03), _log(rng, 0.001, 0.015), _log(rng, 0.002, 0.02)]
    signs = rng.choice([-1.0, 1.0], 3)
    return Plan(
        kind, index, seed, names, laws, asked, departures, fitted, held, zero,
        float(rng.uniform(16.0, 72.0)) if zero != "seen" else 0.0, rate,
        float(800.0 * sizes[0] * signs[0]) if tare and "tare" not in near else 0.0,
        float(sizes[1] * signs[1]) if offset and "zero" not in near else 0.0,
        float(sizes[2] * signs[2]) if late and "timing" not in families else 0.0,
        seeded("law", kind, index), rng.random() < (0.5 if "static_curve" in families else 0.3), rng.random() < 0.35,
    )  # fmt: skip


def _names(kind: str, group: int, rng: np.random.Generator) -> tuple[str, ...]:
    if kind == "none":
        return ()
    if kind in ("single", "outside", "worlds"):
        pool = {"single": INSIDE, "outside": OUTSIDE, "worlds": PHYSICAL}[kind]
        # Each one once, in random order, before any is repeated.
        order = np.random.default_rng(seeded("order", kind, group // len(pool))).permutation(pool)
        return (str(order[group % len(pool)]),)
    if kind == "family":
        return ONE_FAMILY[int(rng.integers(len(ONE_FAMILY)))]
    names: list[str] = []
    while len(names) < (3 if kind == "three" else 2):
        name = str(rng.choice(PHYSICAL))
        family, taken = ALL[name].family, {ALL[other].family for other in names}
        near = _near(taken)
        if not names or (family in near - taken if kind == "alike" else family not in near):
            names.append(name)
        elif kind == "alike" and near == taken:  # no family imitates the first one
            names.clear()
    return tuple(names)


def _near(families: Set[str]) -> set[str]:
    """``families`` and those that imitate them."""
    return {*families}.union(*(IMITATE.get(family, set()) for family in families))


def _laws(effect: Hideable) -> tuple[str, ...]:
    return tuple(law for law in effect.law_names if law)


def _log(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _protocols(names: tuple[str, ...], rng: np.random.Generator) -> tuple[tuple[str, ...], tuple[str, ...]]:
    fitted: list[str] = []
    for name in names:
        pool = [p for p in SHOWN_BY.get(name, PLAIN) if p not in fitted]
        if pool and not set(SHOWN_BY.get(name, ())) & set(fitted):
            fitted.append(str(rng.choice(pool)))
    wanted = max(len(fitted), 2 if rng.random() < 0.7 else 3)
    for protocol in rng.permutation(BESIDE):
        if len(fitted) < wanted and protocol not in fitted:
            fitted.append(str(protocol))
    return tuple(fitted), (str(rng.choice([fitted[0], "mixed", "holds"])),)
