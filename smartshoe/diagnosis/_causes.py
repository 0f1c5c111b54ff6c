"""From a name to a cause: parameters in units, the held-out error without it, and the evidence in sentences."""

from __future__ import annotations

import math
from collections.abc import Sequence

from smartshoe.diagnosis._excitation import Excitation
from smartshoe.diagnosis._held_out import Errors, Gain, errors, gain
from smartshoe.diagnosis._inference import Inference
from smartshoe.diagnosis._members import Alternative
from smartshoe.diagnosis._naming import Name, confidence_of
from smartshoe.diagnosis._parameters import in_unit, parameters_of
from smartshoe.diagnosis._result import OF_A_DOUBTED_CAUSE, OF_A_KIND, Cause, Rival, Statement, likelier_of
from smartshoe.diagnosis._scale import Scale
from smartshoe.diagnosis._session import Session
from smartshoe.diagnosis._zero import Zero
from smartshoe.display import percent
from smartshoe.integrity.thresholds import Thresholds, largest_of_noise
from smartshoe.models.effects import catalogue, in_words, listed
from smartshoe.models.effects.exposure import SAYS
from smartshoe.signals.noise import NORMAL_95


def cause_of(
    name: Name,
    found: Inference,
    fine: Sequence[Session],
    best: Errors,
    scale: Scale,
    excitation: Excitation,
    thresholds: Thresholds,
) -> Cause:
    """The cause for a ``name``; ``best``: held-out errors of the extended model in ``fine``, the full-rate data."""
    member = name.member
    law = name.law_in_place or next((a for a in member.laws if a.effect == name.effect.name), None)
    without = member.without.model.held_as(found.fit.model)
    gained = gain(errors(fine, without), best, scale, thresholds)
    rivals = _rivals_of(name, 0.0 if law is None else law.margin)
    evidence = (
        _evidence_against_nothing(name),
        *_held_out_evidence(member.size, gained, thresholds.material),
        *_nearest_rival(rivals, name.equivalents),
        *_how_sure(name, law, rivals, found, thresholds),
        *_missed_by_law(law, name, thresholds),
        *_beside_kin(name),
        *_missing_excitation(name, excitation),
    )
    by = None if law is None else law.fit
    values = parameters_of(by or found.fit, name.effect.name if by else member.name, scale)
    sure = confidence_of(name), name.law_probability
    return Cause(name.effect, *sure, name.equivalents, values, evidence, gained, member.size, rivals, member.name)


def _rivals_of(name: Name, own: float) -> tuple[Rival, ...]:
    """The rivals, nearest first; margins of laws are counted from ``own``, the margin of the named law to its block."""
    member = name.member
    near = {a.effect: Rival(a.effect, a.margin, "evidence") for a in member.alternatives if a.effect is not None}
    near |= {a.effect: Rival(a.effect, a.margin - own, "fit") for a in member.laws if a.effect is not None}
    near.pop(name.effect.name, None)
    return tuple(one for one in sorted(near.values(), key=lambda one: one.margin) if one.effect in catalogue())


def _evidence_against_nothing(name: Name) -> Statement:
    """How much less probable the data is without the effect."""
    nothing = next((a.margin for a in name.member.alternatives if a.effect is None), 0.0)
    says = f"less likely by {nothing:,.0f} (-2 log likelihood, 10 is strong evidence), though other effects may take"
    says += " its place in part"
    if nothing < 0.0:
        says = f"no less likely (-2 log likelihood falls by {-nothing:,.0f}), since other effects take its place"
    says = f"without it, with all else fitted again, the data is {says}"
    return Statement("fall of -2 log evidence", nothing, 0.0, says)


def _nearest_rival(rivals: Sequence[Rival], equivalents: Sequence[str] = ()) -> list[Statement]:
    """The nearest rival and its margin; nothing where there is none."""
    if not rivals:
        return []
    nearest = rivals[0]
    exact = ", equations taken as exact" if nearest.by == "fit" else ""
    measure = f" (-2 log likelihood{exact})" if abs(nearest.margin) >= 0.5 else ""
    rival = "the nearest rival"
    if equivalents and nearest.effect not in equivalents:
        rival = "the nearest rival that is not an equivalent"
    says = f"{in_words(nearest.effect)}, {rival}, {nearest.says}{measure}"
    return [Statement("margin to the nearest rival", nearest.margin, 0.0, says)]


def _how_sure(
    name: Name, law: Alternative | None, rivals: Sequence[Rival], found: Inference, thresholds: Thresholds
) -> list[Statement]:
    """Why it is named although it is not sure, or although no law of its kind follows."""
    if not name.is_sure:
        does_most_alone = found.best_single is not None and found.best_single.kind == name.effect.kind
        why = (
            "by itself it predicts left-out data best"
            if does_most_alone
            else "it is larger than all that is left unexplained, or than small imperfections and errors of other laws"
        )
        doubt = "it may stand for the error of another equation, or for part of another cause"
        if name.doubt:
            doubt = name.doubt
        elif name.equivalents or likelier_of(rivals, name.equivalents):
            doubt = "other effects do as well"
        says = f"it is not sure, since {doubt}; it is named because {why}"
        return [Statement(OF_A_DOUBTED_CAUSE, name.kind_probability, thresholds.least_confidence, says)]
    if name.kind_only:
        why = "no equation of its kind rules the others out"
        if not name.equivalents:
            nearest = in_words(name.effect.name)
            why = f"{nearest} is by far the nearest, but misses more than equations usually do"
            if law is not None and thresholds.clear * law.margin > name.member.likelihood_ratio:
                why = f"none of its kind follows half of it; {nearest} comes nearest"
        says = (
            f"what it does to the reading is sure, its law is not: {why}, and it may be an effect that the catalogue"
            " does not have"
        )
        return [Statement(OF_A_KIND, name.kind_probability, thresholds.least_confidence, says)]
    return []


def _missed_by_law(law: Alternative | None, name: Name, thresholds: Thresholds) -> list[Statement]:
    """How much of a flexible block, or of a curve at the end of its kind, the law that names it misses."""
    if law is None:
        return []
    missed = 100 * max(law.margin, 0.0) / max(name.member.likelihood_ratio, 1.0)  # of the likelihood ratio
    most = 100 * thresholds.departure**2
    much = "no more" if missed <= most else "more"
    kept = "the free form" if name.member.effect.is_flexible else in_words(name.member.name)
    says = (
        f"its equation misses {percent(0.01 * missed)} of the effect, {much} than equations usually do: the extended"
        f" model keeps {kept}, and the parameters are the equation's"
    )
    return [Statement("share of its kind that the law misses in percent", missed, most, says)]


def _beside_kin(name: Name) -> list[Statement]:
    """The other members of its kind that the extended model has."""
    kin = name.member.kin
    if not kin:
        return []
    alike = "an effect of the same kind" if len(kin) == 1 else "effects of the same kind"
    says = (
        f"the extended model also has {listed(kin, 'and')}, {alike}: one can take most of another's part, so that size,"
        " gain and fall are those of all of them together"
    )
    return [Statement("other effects of its kind in the model", float(len(kin)), 0.0, says)]


def _missing_excitation(name: Name, excitation: Excitation) -> list[Statement]:
    """What would show such an effect best and is missing in this data."""
    lacking = excitation.lacking(name.effect)
    if not lacking:
        return []
    said = "; ".join(sorted(SAYS[word] for word in lacking))
    says = f"what would show it best is missing: {said}"
    return [Statement("what would show it best is missing", float(len(lacking)), 0.0, says)]


def _held_out_evidence(size: float, gained: Gain, material: float) -> list[Statement]:
    """The effect's size and its gain on held-out data; ``size`` and ``material`` are shares of full scale."""
    moves = Statement(
        "size in percent of full scale",
        100 * size,
        100 * material,
        f"it moves the reading by {100 * size:.3g} % of full scale",
    )
    if math.isnan(gained.gain_percent):
        return [moves]
    way = "falls" if gained.rmse_after <= gained.rmse_before else "rises"
    return [
        moves,
        Statement(
            "gain on held-out data in percent",
            gained.gain_percent,
            0.0,
            f"on data that was not fitted the error {way} from {gained.rmse_before:.4g} to {gained.rmse_after:.4g}"
            f" {gained.unit}",
        ),
    ]


def zero_cause_of(zero: Zero, best: Errors, scale: Scale, thresholds: Thresholds, is_of_all: bool = True) -> Cause:
    """The cause for an offset or tare: without it every reading is off, if it ``is_of_all`` recordings."""
    worse = Errors(best.squares + best.counts * zero.size**2, best.counts, best.spread)
    nothing = Errors(best.squares[:0], best.counts[:0], math.nan)
    gained = gain(worse if is_of_all else nothing, best, scale, thresholds)
    parameter = zero.effect.parameters[0]
    factor, unit = (scale.load_n, "N") if "FS_load" in parameter.unit else (scale.reading, scale.unit.symbol)
    interval = zero.value - NORMAL_95 * zero.sd, zero.value + NORMAL_95 * zero.sd
    values = {parameter.name: in_unit(zero.value, zero.sd, interval, factor, unit)}
    deviations = abs(zero.value) / zero.sd
    seen = Statement(
        "deviations from nothing",
        deviations,
        largest_of_noise(1, thresholds),
        f"it is {deviations:.3g} standard deviations from zero",
    )
    sure = (
        1.0 - thresholds.false_name if zero.is_seen else thresholds.least_confidence,  # or seen by the model only
        1.0 / (1.0 + len(zero.alternatives)),
    )
    evidence = (seen, *_held_out_evidence(zero.size, gained, thresholds.material))
    return Cause(zero.effect, *sure, zero.alternatives, values, evidence, gained, zero.size)
