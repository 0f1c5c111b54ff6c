"""How a diagnosis of a hidden case is scored, against the truth that made the case.

*Named* are the causes, and for faults of the data (families noise, data, saturation) the data faults too.

- *exact*: every hidden effect is named, none comes after a nuisance less than half as strong as itself, and whatever
  else is named is a nuisance that is there, by its effect or its family. A nuisance of 0.03-0.08 % of full scale lies
  above the materiality threshold of 0.02 %: naming it is right.
- *within equivalents*: the same, but for an effect it is enough to stand among a cause's ``equivalents``.
- *family*: the families of the hidden effects are named, and no other but those of nuisances.
- *wrong*: causes that are neither hidden nor nuisances nor of a nuisance's family. A data fault that is not there
  is counted by itself, and spoils *exact* and *family* as well; `minor` ones, which ask for nothing, do not.
- *parameters*: those that the truth shares with the catalogue's equation; right within the 95 % interval or 10 %.
- *removed*: 1 - sum (truth - extended)^2 / sum (truth - baseline)^2 over the held-out recordings' twins without noise:
  the share of the explainable held-out variance that the extension takes away.
- *confidence* of a cause is right where its effect is hidden, or it is a nuisance by effect or family.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from simulators.hidden.effects import EFFECTS
from simulators.hidden.recordings import HiddenCase
from smartshoe.diagnosis import Cause, Diagnosis, Thresholds
from smartshoe.diagnosis._scale import Scale
from smartshoe.diagnosis._session import prepare

# What a fault's word of its own stands for.
FAULT_IS = {
    "two_clocks": ("delay", "clock_drift", "sensor_lag"),
    "low_rail": ("saturation",),
    "missing_samples": ("dropouts",),
    "gaps": ("dropouts",),
}
FAULT_FAMILIES = frozenset({"noise", "data", "saturation"})
WITHIN = 0.1


@dataclass(frozen=True)
class Named:
    """One cause: is it right, how sure is it, and what the confidence was made of (``margin`` to the nearest rival)."""

    effect: str
    family: str
    right: bool
    confidence: float
    equivalents: tuple[str, ...]
    margin: float
    fall: float
    size_percent: float
    gain_percent: float


@dataclass(frozen=True)
class Compared:
    """One parameter of a hidden effect that was named: fitted against truth, in the truth's unit."""

    effect: str
    parameter: str
    truth: float
    fitted: float
    low: float
    high: float

    @property
    def right(self) -> bool:
        """Within the interval, or within a tenth."""
        return self.low <= self.truth <= self.high or abs(self.fitted - self.truth) <= WITHIN * abs(self.truth)


@dataclass(frozen=True)
class Score:
    """See the module."""

    exact: bool
    within_equivalents: bool
    family: bool
    wrong: tuple[str, ...]
    false_faults: tuple[str, ...]
    named: tuple[Named, ...]
    faults: tuple[str, ...]
    parameters: tuple[Compared, ...]
    gain_percent: float
    removed: float | None

    @classmethod
    def from_dict(cls, held: dict[str, Any]) -> Score:
        """The inverse of `dataclasses.asdict`, as JSON brings it."""
        named = tuple(Named(**{**one, "equivalents": tuple(one["equivalents"])}) for one in held["named"])
        parameters = tuple(Compared(**one) for one in held["parameters"])
        words = {name: tuple(held[name]) for name in ("wrong", "false_faults", "faults")}
        return cls(**{**held, **words, "named": named, "parameters": parameters})


def score(case: HiddenCase, diagnosis: Diagnosis) -> Score:
    """The score of ``diagnosis`` of ``case``."""
    hidden = [effect.name for effect in case.effects]
    inside = [name for name in hidden if EFFECTS[name].inside]
    faults = tuple(sorted({fault.kind for fault in diagnosis.data_faults}))
    loud = {fault.kind for fault in diagnosis.data_faults if fault.severity != "minor"}
    true_faults = {kind for kind in faults if {kind, *FAULT_IS.get(kind, ())} & set(hidden)}
    named = tuple(_named(cause, case) for cause in diagnosis.causes)
    wrong = tuple(one.effect for one in named if not one.right)
    false_faults = tuple(kind for kind in faults if kind in loud and kind not in true_faults)
    found = {one.effect for one in named} | true_faults
    like = found | {other for one in named for other in one.equivalents}
    families = {one.family for one in named} | {EFFECTS[k].family for k in true_faults if k in EFFECTS}
    asked_families = {EFFECTS[name].family for name in inside}
    tolerable = asked_families | _nuisance_families(case)
    first = _come_first(case, [one.effect for one in named], set(inside) & true_faults)
    first_like = first or any(set(one.equivalents) & set(inside) for one in named)
    # A cause whose equivalents hold a hidden effect stands for it.
    wrong_like = [one for one in named if not one.right and not set(one.equivalents) & set(inside)]
    clean = not false_faults
    return Score(
        exact=clean and not wrong and set(inside) <= found and first,
        within_equivalents=clean and not wrong_like and set(inside) <= like and first_like,
        family=clean and asked_families <= families and {one.family for one in named} <= tolerable,
        wrong=wrong,
        false_faults=false_faults,
        named=named,
        faults=faults,
        parameters=tuple(one for cause in diagnosis.causes for one in _compared(cause, case)),
        gain_percent=diagnosis.gain.gain_percent if diagnosis.gain else 0.0,
        removed=removed(case, diagnosis),
    )


def _named(cause: Cause, case: HiddenCase) -> Named:
    hidden = {effect.name for effect in case.effects}
    margin = min((rival.margin for rival in cause.rivals), default=float("nan"))
    fall = next((s.value for s in cause.evidence if s.statistic.startswith("fall")), float("nan"))
    right = cause.name in hidden or cause.name in case.nuisances or cause.effect.family in _nuisance_families(case)
    return Named(
        cause.name, cause.effect.family, right, cause.confidence, cause.equivalents, margin, fall, 100.0 * cause.size,
        cause.held_out.gain_percent,
    )  # fmt: skip


def _nuisance_families(case: HiddenCase) -> set[str]:
    return {effect.family for effect in case.nuisances.values()}


def _come_first(case: HiddenCase, named: list[str], as_faults: set[str]) -> bool:
    """Whether no hidden effect stands behind a nuisance that is less than half as strong."""
    strength = {effect.name: effect.strength_percent_fs for effect in case.effects}
    largest = max((effect.strength_percent_fs for effect in case.nuisances.values()), default=0.0)
    places = [named.index(name) for name in strength if name in named and strength[name] > 2.0 * largest]
    return all(place < len(strength) - len(as_faults - set(named)) for place in places)


def removed(case: HiddenCase, diagnosis: Diagnosis) -> float | None:
    """Share of the explainable held-out variance removed; None for faults of the data and where there is no model."""
    if diagnosis.model is None or diagnosis.baseline_model is None:
        return None
    if not case.effects or any(not e.inside or e.family in FAULT_FAMILIES for e in case.effects):
        return None
    twins = case.noise_free[len(case.recordings) :]
    model = diagnosis.model
    scale = Scale(model.full_scale_load_n, model.full_scale_reading, case.recordings[0].sensor.unit)
    sessions = prepare(twins, [np.ones(len(twin), dtype=bool) for twin in twins], None, scale, [1], Thresholds())
    before = sum(float(np.sum((s.reading - diagnosis.baseline_model.simulate(s.conditions)) ** 2)) for s in sessions)
    after = sum(float(np.sum((s.reading - model.simulate(s.conditions)) ** 2)) for s in sessions)
    return 1.0 - after / before


# -- parameters --------------------------------------------------------------------------------------------------------
UNITS = ("_mbar_per_k", "_mbar_per_s", "_per_k", "_per_s", "_mbar", "_n", "_s", "_hz")
# Truths that are one over what is fitted.
INVERSE = {("gas_heat", "time_constant_s"): "cooling_rate"}


def _compared(cause: Cause, case: HiddenCase) -> list[Compared]:
    """The parameters of a named hidden effect that have a counterpart in the truth (`simulators.hidden.effects`)."""
    hidden = next((effect for effect in case.effects if effect.name == cause.name), None)
    found = []
    for name, truth in hidden.catalogue.items() if hidden is not None else ():
        inverse = INVERSE.get((cause.name, name))
        plain = inverse or _bare(name)
        if plain not in cause.parameters and cause.effect.family in FAULT_FAMILIES:
            continue  # noise is described, not fitted
        if plain not in cause.parameters:
            raise KeyError(f"{cause.name}: the truth's {name} has no counterpart {plain} among what is fitted")
        parameter = cause.parameters[plain]
        value, low, high = parameter.value, *parameter.ci95
        if inverse is not None:
            value, low, high = 1.0 / value, 1.0 / high, 1.0 / low if low > 0 else float("inf")
        found.append(Compared(cause.name, name, truth, value, low, high))
    return found


def _bare(name: str) -> str:
    """``name`` without the unit behind it."""
    return next((name.removesuffix(unit) for unit in UNITS if name.endswith(unit)), name)
