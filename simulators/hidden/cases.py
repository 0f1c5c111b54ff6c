"""A case of the bank: recordings of a unit with hidden effects under chosen laws, and the record of the truth."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from simulators.hidden import _protocols as protocols
from simulators.hidden._baseline import lagged, left_over
from simulators.hidden._machine import Chain, Departed, Given, lawful_machine, logged, recorded
from simulators.hidden._scaling import SILENT, HiddenEffect, clipped_at_an_end, search
from simulators.hidden.effects import SHARE_OF_RANGE, Hideable, Options, Subject, Warp, merged
from simulators.hidden.plans import ALL, MOST_DEPARTURE, Plan, plan, seeded
from simulators.hidden.recordings import drawn_subject, noise_options, small_effects
from smartshoe.arrays import Array
from smartshoe.protocol import Protocol
from smartshoe.recording import Recording

BEFORE_S = 60.0  # time under the first load before a record that starts loaded
NUISANCES = (2, 4)  # their number: lower bound, excluded upper bound
POLES = (1.0, 1.3)  # times the unit's own rate: a small change of the baseline is not part of a departure


@dataclass(frozen=True, eq=False)
class HiddenLaw:
    """One hidden effect: its law, its strength, and how far it departs from the law's plain form.

    ``departure`` is the residual after fitting the law without its warp, and a baseline, as a share of the law's own
    size; None where the law has no warp.
    """

    effect: Hideable
    law: str
    asked_percent_fs: float
    strength_percent_fs: float
    departure: float | None
    options: Options
    chain: Chain
    note: str = ""


@dataclass(frozen=True, eq=False)
class BankCase:
    """One case: ``recordings`` to fit, ``hold_out`` to judge the fit on, and ``truth`` about their content."""

    plan: Plan
    recordings: tuple[Recording, ...]
    hold_out: tuple[Recording, ...]
    hidden: tuple[HiddenLaw, ...]
    nuisances: tuple[HiddenEffect, ...]
    subject: Subject
    noise_percent_fs: float
    options: Options
    silent_options: Options
    protocols: tuple[Protocol, ...]

    @property
    def chain(self) -> Chain:
        """All further laws of the case."""
        return _joined([one.chain for one in self.hidden])

    @cached_property
    def noise_free_hold_out(self) -> tuple[Recording, ...]:
        """Twins of the ``hold_out`` recordings without noise on load and reading."""
        fitted = len(self.recordings)
        return _cut(
            self.plan,
            self._silent(merged(self.silent_options, *(one.options for one in self.hidden)), self.chain, fitted, None),
        )

    def alone(self, number: int) -> tuple[Recording, ...]:
        """The fitted recordings with only hidden effect ``number``, without noise."""
        one = self.hidden[number]
        options = merged(self.subject.options(), _logger(self.plan), SILENT, one.options)
        return _cut(self.plan, self._silent(options, one.chain, 0, len(self.recordings)))

    def _silent(self, options: Options, chain: Chain, first: int, last: int | None) -> tuple[Recording, ...]:
        return recorded(options, self.protocols[first:last], self.plan.seed, chain, self.subject)

    @property
    def truth(self) -> dict[str, Any]:
        """The truth as a JSON object; which effects cannot be distinguished is added by the caller."""
        p = self.plan
        return {
            "schema": "smartshoe.hidden_case/1", "kind": p.kind, "index": p.index, "seed": p.seed,
            "effects": [
                {
                    "id": one.effect.name, "family": one.effect.family, "law": one.law,
                    "strength_percent": round(one.strength_percent_fs, 4),
                    "asked_percent": round(one.asked_percent_fs, 4),
                    "departure_from_law": None if one.departure is None else round(one.departure, 4),
                    "note": one.note, "cannot_be_told_from": [],
                }
                for one in self.hidden
            ],
            "nuisances": [
                {"effect": _as_catalogued(n.name), "family": n.family,
                 "strength_percent": round(n.strength_percent_fs, 4)}
                for n in self.nuisances
            ],
            "conditions": conditions(p, self.subject),
            "zero": p.zero, "sample_rate_hz": p.sample_rate_hz, "lowest_load_n": round(p.floor_n, 1),
            "fit": [r.name for r in self.recordings], "hold_out": [r.name for r in self.hold_out],
            "noise_percent": round(self.noise_percent_fs, 4), "full_scale_mbar": round(self.subject.full_scale_mbar, 3),
            "samples": sum(len(r) for r in self.recordings + self.hold_out),
        }  # fmt: skip


def _as_catalogued(name: str) -> str:
    return "play_hysteresis" if name == "mild_hysteresis" else name


def conditions(p: Plan, subject: Subject) -> list[dict[str, Any]]:
    """Tare, offset and delay of the case besides its effects.

    They are not small, and count as true causes when named.
    """
    found: list[dict[str, Any]] = []
    alike = [] if p.zero == "seen" else [True]
    if p.tare_n:
        found.append({
            "effect": "load_cell_tare", "family": "tare", "strength_percent": round(abs(p.tare_n) / 8.0, 4),
            "size": f"{p.tare_n:+.2f} N in the log", "cannot_be_told_from": ["zero_offset"] if alike else [],
        })  # fmt: skip
    if p.offset_share:
        found.append({
            "effect": "zero_offset", "family": "zero", "strength_percent": round(100.0 * abs(p.offset_share), 4),
            "size": f"{p.offset_share * subject.full_scale_mbar:+.3f} mbar",
            "cannot_be_told_from": ["load_cell_tare"] if alike else [],
        })  # fmt: skip
    if p.late_s:
        found.append({
            "effect": "delay", "family": "timing", "strength_percent": None,
            "size": f"{1000.0 * p.late_s:+.1f} ms (positive: the reading is late)",
        })  # fmt: skip
    return found


def case(kind: str, index: int) -> BankCase:
    """Case ``index`` of ``kind`` (`simulators.hidden.plans.KINDS`); reproducible."""
    return make(plan(kind, index))


def make(p: Plan) -> BankCase:
    """The case that plan ``p`` describes."""
    rng = np.random.default_rng([p.seed, 2])
    protocols = _protocols(p)
    subject = drawn_subject(rng, None, protocols[0].duration_s, "second_relaxation" in p.effects)
    logger = _logger(p)
    hidden: list[HiddenLaw] = []
    planned = zip(p.effects, p.laws, p.asked_percent, p.departures, strict=True)
    # The range depends on compression, and all other strengths depend on the range.
    for name, law, asked, departure in sorted(planned, key=lambda each: each[0] != "gas_compression"):
        one = _hide(p, ALL[name], law, asked, departure, subject, protocols[0], logger)
        hidden.append(one)
        if "range_mbar" in one.options.get("sensor", {}):
            subject = replace(subject, range_mbar=one.options["sensor"]["range_mbar"])
    hidden.sort(key=lambda one: p.effects.index(one.effect.name))
    around = np.random.default_rng([p.seed, 4])
    nuisances = small_effects(around, int(around.integers(*NUISANCES)), set(p.families) | _of_conditions(p), subject,
                              protocols[0], p.seed, logger)  # fmt: skip
    noise, share = float(around.uniform(0.05, 0.25)), float(around.uniform(0.0, 0.5))
    colour_s = float(np.exp(around.uniform(np.log(0.03), np.log(0.5))))
    if any(one.effect.family == "noise" for one in hidden):
        noise *= 0.4
    noisy = merged(
        {"load_noise_n": float(around.uniform(0.15, 0.7))},
        noise_options(noise, share, colour_s, {one.effect.name for one in hidden}),
    )
    conditioned: Options = {
        "load_cell_tare_n": p.tare_n,
        "sensor": {"zero_offset_mbar": p.offset_share * subject.full_scale_mbar},
        "daq": {"reading": {"delay_s": p.late_s}},
    }
    small = [overlay for overlay, _ in nuisances.values()]
    common = merged(subject.options(), logger, *small, _beside(conditioned, small))
    chain = _joined([one.chain for one in hidden])
    whole = merged(common, noisy, *(one.options for one in hidden))
    made = tuple(_logged_channels(p, r) for r in _cut(p, recorded(whole, protocols, p.seed, chain, subject)))
    return BankCase(
        plan=p, recordings=made[: len(p.fitted)], hold_out=made[len(p.fitted) :], hidden=tuple(hidden),
        nuisances=tuple(effect for _, effect in nuisances.values()), subject=subject, noise_percent_fs=noise,
        options=whole, silent_options=merged(common, SILENT), protocols=protocols,
    )  # fmt: skip


def _of_conditions(p: Plan) -> set[str]:
    found = {"tare"} if p.tare_n else set()
    return found | ({"zero", "tare"} if p.offset_share else set()) | ({"timing"} if p.late_s else set())


def _beside(conditioned: Options, small: Sequence[Options]) -> Options:
    """The conditions without those that a nuisance already sets, since each family can occur only once."""
    return conditioned if not small else merged(conditioned, *small)


def _logger(p: Plan) -> Options:
    return {"daq": {"sample_rate_hz": p.sample_rate_hz}}


def _protocols(p: Plan) -> tuple[Protocol, ...]:
    rng = np.random.default_rng([p.seed, 3])
    built = []
    for k, name in enumerate((*p.fitted, *p.held)):
        protocol = protocols.build(name, rng, other=k >= len(p.fitted))
        if p.zero == "never_unloaded":
            protocol = protocols.never_unloaded(protocol, p.floor_n, BEFORE_S)
        elif p.zero == "starts_loaded":
            protocol = protocols.begun_loaded(protocol, p.floor_n, BEFORE_S)
        built.append(replace(protocol, name=f"{name}_{k + 1}"))
    return tuple(built)


def _cut(p: Plan, made: Sequence[Recording]) -> tuple[Recording, ...]:
    """The recordings without the time before the record begins."""
    if p.zero == "seen":
        return tuple(made)
    cut = [r.between(BEFORE_S, r.time_s[-1] + 1.0) for r in made]
    return tuple(replace(r, time_s=r.time_s - r.time_s[0]) for r in cut)


def _logged_channels(p: Plan, recording: Recording) -> Recording:
    """The recording, with crosshead and command kept only where the plan logs them."""
    dropped = [] if p.logs_displacement else ["displacement"]
    return recording.without(*dropped, *([] if p.logs_command else ["command"]))


def _joined(chains: Sequence[Chain]) -> Chain:
    return Chain(
        tuple(one for chain in chains for one in chain.given), tuple(one for chain in chains for one in chain.departed)
    )


# -- one effect at its strength ----------------------------------------------------------------------------------------
def _hide(
    p: Plan, effect: Hideable, name: str, asked: float, departure: float, subject: Subject, protocol: Protocol,
    logger: Options,
) -> HiddenLaw:  # fmt: skip
    law = effect.named(name)
    draw = effect.draw if law is None else law.draw
    rng = np.random.default_rng([p.law_seed, zlib.crc32(effect.name.encode())])
    draws, unit_warp, seed = draw(rng, subject), Warp.drawn(rng), int(rng.integers(2**31))
    ranged = effect.name == "gas_compression" and law is None  # its amount is the range itself
    can_depart = (effect.bends if law is None else law.bends) is not None and not ranged
    bounded = (
        effect if law is None else replace(
            effect, parameter=law.name, unit="1", typical=law.typical, largest=law.largest
        )
    )  # fmt: skip

    def placed(amount: float, size: float) -> tuple[Options, Chain]:
        warp = replace(unit_warp, size=size)
        if law is None:
            options = effect.options(amount, draws, subject)
            if size and effect.bends is not None:
                return {}, Chain((), (Departed(options, effect.bends, warp),))
            return options, Chain()
        if law.options is not None:
            return law.options(amount, draws, subject), Chain()
        return {}, Chain((Given(law, amount, draws, warp, seed),))

    def departs_by(amount: float, size: float) -> float:
        return _departure(p, effect, placed, amount, size, subject, protocol, logger)

    size = 0.0
    if can_depart and departure > 0:
        full = departs_by(min(bounded.typical * asked, 0.5 * bounded.largest), 1.0)
        size = min(1.0, departure / max(full, 1e-6))

    def strength(amount: float) -> tuple[float, bool]:
        options, chain = placed(amount, size)
        given = merged(subject.options(), logger, options, SILENT)
        recording, clipped = _pressed(p, given, chain, subject, protocol)
        full_scale = SHARE_OF_RANGE * float(given["sensor"]["range_mbar"])
        left = left_over(
            recording.force_n, recording["pressure"].with_nan(), recording.sample_time_s, constant=not effect.needs_zero
        )
        return 100.0 * left / full_scale, clipped

    while True:
        amount, reached, note = search(strength, asked, bounded)
        departs = departs_by(amount, size) if size else 0.0
        if departs <= MOST_DEPARTURE:
            break
        size *= departure / departs  # the departure of a law that is not linear depends on its amount
    options, chain = placed(amount, size)
    return HiddenLaw(effect, name, asked, reached, departs if can_depart else None, options, chain, note)


def _pressed(p: Plan, options: Options, chain: Chain, subject: Subject, protocol: Protocol) -> tuple[Recording, bool]:
    with lawful_machine(options, p.seed, chain, subject) as machine:
        made = machine.run(protocol)
        clipped = clipped_at_an_end(machine)
    return _cut(p, [logged(made, chain, subject, 1)])[0], clipped


def _departure(p, effect, placed, amount, size, subject, protocol, logger) -> float:  # type: ignore[no-untyped-def]
    """The law's residual after fitting it without its warp, at any amount, as a share of its own size."""
    made = []
    for options, chain in (placed(amount, size), placed(amount, 0.0), ({}, Chain())):
        given = merged(subject.options(), logger, options, SILENT)
        made.append(_pressed(p, given, chain, subject, protocol)[0])
    bent, straight, none = (r["pressure"].with_nan() for r in made)
    load, step_s = made[2].force_n, made[2].sample_time_s
    beside = [load, *(lagged(load, step_s, pole / subject.time_constant_s) for pole in POLES)]
    if not effect.needs_zero:
        beside.append(np.ones(load.size))
    own = _outside(np.column_stack(beside), bent - none)
    rest = _outside(np.column_stack([*beside, straight - none]), bent - none)
    return float(rest / own) if own > 0 else 0.0


def _outside(columns: Array, signal: Array) -> float:
    present = np.isfinite(signal)
    basis, _ = np.linalg.qr(columns[present] / np.maximum(np.abs(columns[present]).max(axis=0), 1e-12))
    return float(np.linalg.norm(signal[present] - basis @ (basis.T @ signal[present])))


__all__ = ["BankCase", "HiddenLaw", "case", "make", "plan", "seeded"]
