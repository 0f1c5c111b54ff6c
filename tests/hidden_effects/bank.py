"""Cases of the first laws alone, drawn from (set, index), for the ordinary tests; the bank is `bank_run`.

A case is fixed by its set and its index; nothing else is drawn. Sets and their seeds, none of which the development
of the diagnosis used (that took 0-50 and 1000-1400):

========== ======= =========================================================================
grid       500,000 one effect at 0.05, 0.1, 0.3, 1 or 3 % of full scale: the table by effect
single     520,000 one effect, strength log-uniform from 0.1 to 10 % or what it can have
pair       540,000 two effects of different families, physical ones, each 0.3 to 3 %
none       560,000 no effect
outside    580,000 one effect that the catalogue does not have, 0.3 to 10 %
calibrate  900,000 a mixture of these: what the confidence is calibrated on, and never judged by
========== ======= =========================================================================

Every case has noise of 0.1-0.3 % of full scale, partly coloured, and two nuisances (`simulators.hidden.recordings`). An
effect is drawn with a protocol that can show it, and tell it from its neighbours as far as any load history does:
`SHOWN_BY` follows the last column of the catalogue. No effect is asked for more than it can have: `STRONGEST`, from
docs/simulated_effects.md, and what a unit and protocol cannot reach is halved (`within_reach`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from simulators.hidden.effects import EFFECTS
from simulators.hidden.recordings import HiddenCase, hide
from smartshoe.models.effects import catalogue

GRID_PERCENT = (0.05, 0.1, 0.3, 1.0, 3.0)
SEEDS = {
    "grid": 500_000, "single": 520_000, "pair": 540_000, "none": 560_000, "outside": 580_000, "calibrate": 900_000,
}  # fmt: skip
MIXTURE = ("single", "grid", "pair", "single", "none", "outside", "single", "pair")
PLAIN = ("rates_and_holds", "rates", "shuffled")
HELD = ("rates_and_holds", "static")
SHOWN_BY: dict[str, tuple[str, ...]] = {
    "second_relaxation": ("rates_and_holds", "step"), "power_law_creep": (*HELD, "step"),
    "linear_leak": (*HELD, "long_hold"), "orifice_leak": HELD, "permanent_set": (*HELD, "shuffled"),
    "gas_heat": ("rates_and_holds", "rates", "step"),
    "gas_compression": (*PLAIN, "static"), "wall_hardening": (*PLAIN, "static"), "contact_area": (*PLAIN, "static"),
    "sensor_nonlinearity": (*PLAIN, "static"), "dead_band": (*PLAIN, "static"),
    "play_hysteresis": ("rates_and_holds", "shuffled", "minor_loops"),
    "bouc_wen_hysteresis": ("rates_and_holds", "shuffled", "minor_loops"),
    "load_unload_asymmetry": (*PLAIN, "minor_loops"),
    "sensor_lag": (*PLAIN, "step", "multisine"), "delay": (*PLAIN, "step", "multisine"),
    "gain_drift": (*PLAIN, "idle"), "zero_drift": ("rates_and_holds", "shuffled", "idle"),
    "warm_up": ("rates_and_holds", "shuffled", "idle"),
    "zero_offset": (*PLAIN, "static", "idle"), "load_cell_tare": (*PLAIN, "static"),
    "heteroscedastic_noise": ("rates_and_holds", "static"), "timing_jitter": ("rates", "shuffled"),
    "quantisation": ("rates_and_holds", "static"),
}  # fmt: skip
STRONGEST = {
    "second_relaxation": 1.0, "power_law_creep": 2.0, "gas_heat": 0.8, "gas_compression": 1.6, "sensor_lag": 0.8,
    "sensor_nonlinearity": 2.5, "held_samples": 1.0,
}  # fmt: skip
USUALLY_STRONGEST = 10.0
BEYOND = ("the most that", "clip")  # remarks of `hide` where a strength is out of reach
MOST_HALVINGS = 4
INSIDE = tuple(name for name, effect in EFFECTS.items() if effect.inside)
OUTSIDE = tuple(name for name, effect in EFFECTS.items() if not effect.inside)
PHYSICAL = tuple(name for name in INSIDE if catalogue()[name].is_physical)


@dataclass(frozen=True)
class Drawn:
    """One case before it is made: ``effects`` by name with the strength asked for in percent of full scale."""

    kind: str
    index: int
    seed: int
    protocol: str
    effects: dict[str, float]

    def hidden(self) -> HiddenCase:
        """The recordings."""
        return within_reach(self.effects, self.protocol, self.seed)


def drawn(kind: str, index: int) -> Drawn:
    """Case ``index`` of the set ``kind``: always the same."""
    seed = SEEDS[kind] + index
    rng = np.random.default_rng([seed, 77])
    like = MIXTURE[index % len(MIXTURE)] if kind == "calibrate" else kind
    names: tuple[str, ...]
    match like:
        case "grid":
            name, percent = _cell(index if kind == "grid" else int(rng.integers(10_000)))
            return Drawn(kind, index, seed, str(rng.choice(protocols_of(name))), {name: percent})
        case "single":
            # In turn, so that a short bank has every effect once.
            name = INSIDE[index % len(INSIDE)] if kind == "single" else str(rng.choice(INSIDE))
            names, low, high = (name,), 0.1, 10.0
        case "pair":
            names, low, high = _pair(rng), 0.3, 3.0
        case "none":
            return Drawn(kind, index, seed, str(rng.choice(PLAIN)), {})
        case "outside":
            names, low, high = (OUTSIDE[index % len(OUTSIDE)],), 0.3, 10.0
        case _:
            raise ValueError(f"there is no set {kind!r} in the bank: use one of {', '.join(SEEDS)}")
    together = [protocol for protocol in protocols_of(names[0]) if protocol in protocols_of(names[-1])]
    asked = {name: float(np.exp(rng.uniform(np.log(low), np.log(min(high, strongest(name)))))) for name in names}
    return Drawn(kind, index, seed, str(rng.choice(together)), asked)


def protocols_of(name: str) -> tuple[str, ...]:
    """The protocols that show the effect ``name``."""
    return SHOWN_BY.get(name, PLAIN)


def strongest(name: str) -> float:
    """What the effect ``name`` may be asked for, percent of full scale."""
    return STRONGEST.get(name, USUALLY_STRONGEST)


def _cell(index: int) -> tuple[str, float]:
    """The grid's cells: every effect once before any comes again, strengths in turn; no strength beyond reach."""
    strengths = len(GRID_PERCENT)
    turns = [
        (name, GRID_PERCENT[(place + turn) % strengths])
        for turn in range(strengths)
        for place, name in enumerate(INSIDE)
    ]
    cells = [(name, percent) for name, percent in turns if percent <= strongest(name)]
    return cells[index % len(cells)]


def _pair(rng: np.random.Generator) -> tuple[str, str]:
    while True:
        one, other = (str(name) for name in rng.choice(PHYSICAL, 2, replace=False))
        shared = set(protocols_of(one)) & set(protocols_of(other))
        if shared and EFFECTS[one].family != EFFECTS[other].family:
            return one, other


def within_reach(effects: dict[str, float], protocol: str, seed: int, **given: Any) -> HiddenCase:
    """`hide`, with a strength halved that the effect cannot have on this unit and protocol.

    At its strongest an effect drives the sensor into its rails, or is a parameter that no unit has.
    """
    case = hide(effects, protocol=protocol, seed=seed, **given)
    for _ in range(MOST_HALVINGS):
        beyond = {effect.name for effect in case.effects if any(word in effect.note for word in BEYOND)}
        if not beyond:
            break
        effects = {name: percent / 2 if name in beyond else percent for name, percent in effects.items()}
        case = hide(effects, protocol=protocol, seed=seed, **given)
    return case
