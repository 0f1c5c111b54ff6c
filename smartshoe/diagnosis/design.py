"""What a protocol can show before anything is measured: which effects, and which of them it separates."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from smartshoe.arrays import Array, require_positive
from smartshoe.diagnosis._baseline import USUAL
from smartshoe.diagnosis._excitation import excitation_of
from smartshoe.diagnosis._experiments import sessions_on
from smartshoe.diagnosis._inference import can_validate
from smartshoe.diagnosis._limits import ONE_CYCLE
from smartshoe.diagnosis._naming import odds_of_law
from smartshoe.diagnosis._sensitivity import Candidate, Linearised, linearised, logged_words
from smartshoe.display import counted
from smartshoe.errors import UsageError
from smartshoe.integrity.thresholds import Thresholds, decided_by
from smartshoe.kernels.blas import on_one_thread
from smartshoe.models.effects import catalogue
from smartshoe.models.extended import ExtendedModel
from smartshoe.protocol import Protocol

USUAL_NOISE_PERCENT, USUAL_RATE_HZ = 0.1, 100.0  # noise, and rate of the log, where no unit states its own


@dataclass(frozen=True, eq=False)
class Design:
    """What a protocol can show.

    ``least`` (n,) is the size from which each of the effects ``names`` shows, rms as a share of full scale of all it
    does to the reading; infinite where the baseline follows it completely. ``unlike`` (n, n) is the share of an
    effect's evidence that another effect in its place cannot follow. ``evidence`` is -2 log of that for an effect of
    size ``strength`` (rms share of full scale) beyond what the baseline follows, for which `cannot_be_told` answers.
    ``limits`` are those that a diagnosis of such recordings would have in any case. ``left_out`` are the channels that
    further effects need, by name, since a design has load and reading only.
    """

    names: tuple[str, ...]
    least: Array
    unlike: Array
    strength: float
    evidence: float
    thresholds: Thresholds
    limits: tuple[str, ...] = ()
    left_out: Mapping[str, frozenset[str]] = field(default_factory=dict)

    def cannot_be_told(self, name: str) -> tuple[str, ...]:
        """The effects that this protocol would not separate from ``name``, most alike first.

        By the odds with which a diagnosis compares laws: another effect misses a share of the evidence.
        """
        k = self.names.index(name)
        alike = odds_of_law(self.unlike[k] * self.evidence, self.evidence, self.thresholds)
        order = np.argsort(-alike, kind="stable")
        return tuple(self.names[j] for j in order if j != k and alike[j] > self.thresholds.equivalent_odds)

    def to_dict(self) -> dict[str, Any]:
        """Schema ``smartshoe.design/1``."""
        return {
            "schema": "smartshoe.design/1",
            "strength_percent_of_full_scale": 100.0 * self.strength,
            "effects": [
                {
                    "effect": name,
                    "least_percent_of_full_scale": 100.0 * float(least) if np.isfinite(least) else None,
                    "cannot_be_told_from": list(self.cannot_be_told(name)),
                }
                for name, least in zip(self.names, self.least, strict=True)
            ],
            "pairs": [
                {"effects": [a, b], "unlike": float(self.unlike[i, j])}
                for i, a in enumerate(self.names)
                for j, b in enumerate(self.names)
                if i != j
            ],
            "limits": list(self.limits),
            "left_out": [{"effect": name, "needs": sorted(words)} for name, words in self.left_out.items()],
        }


@on_one_thread
def design(
    protocols: Sequence[Protocol],
    *,
    noise_percent: float = USUAL_NOISE_PERCENT,
    strength_percent: float = 0.3,
    sample_rate_hz: float = USUAL_RATE_HZ,
    unit: ExtendedModel = USUAL,
    thresholds: Thresholds | None = None,
) -> Design:
    """Which effects the protocols, run once each, would show and tell apart.

    Parameters
    ----------
    protocols
        What the machine would run; each is a recording of its own.
    noise_percent
        Standard deviation of the reading's white noise, percent of full scale.
    strength_percent
        The strength that is asked about: rms percent of full scale beyond what the baseline follows.
    sample_rate_hz
        Of the log.
    unit
        A unit like the one to be measured.

    Raises
    ------
    UsageError
        Without a protocol, where none bears a load or one is too short, and for numbers that are not positive.
    """
    if not protocols:
        raise UsageError("a design needs a protocol: give one at least")
    given = {"noise_percent": noise_percent, "strength_percent": strength_percent, "sample_rate_hz": sample_rate_hz}
    for name, value in given.items():
        require_positive(value, name)
    limits = decided_by(thresholds)
    peak_n = max(protocol.peak_load_n for protocol in protocols)
    if not peak_n > 0:
        raise UsageError(
            f"no load is put on in {', '.join(one.name for one in protocols)}: give a protocol that presses"
        )
    for protocol in protocols:
        if said := too_short_of(protocol, sample_rate_hz, limits):
            raise UsageError(said)
    sessions, factors = sessions_on(unit, protocols, peak_n, 1.0 / sample_rate_hz, limits)
    columns = linearised(unit, sessions, limits)
    # Thinning averages neighbours, which reduces the noise.
    sd = 0.01 * noise_percent / math.sqrt(min(factors))
    # With one load cycle no cause is named, whatever its columns show.
    lacking = [] if can_validate(sessions, limits) else [ONE_CYCLE]
    excitation = replace(excitation_of(sessions, limits), is_judged=True)
    lacking += excitation.limits()
    hidden = frozenset(name for name, one in catalogue().items() if excitation.hides(one))
    found = _compared(columns, sd, 0.01 * strength_percent, limits, hidden)
    logged = logged_words(sessions)
    left_out = {name: one.needs - logged for name, one in catalogue().items() if one.is_physical and one.needs - logged}
    return replace(found, limits=tuple(lacking), left_out=left_out)


def too_short_of(protocol: Protocol, sample_rate_hz: float, thresholds: Thresholds | None = None) -> str | None:
    """The sentence on a protocol whose log has fewer samples than a diagnosis needs; None if it has enough."""
    samples, least = math.ceil(protocol.duration_s * sample_rate_hz), decided_by(thresholds).least_samples
    if samples >= least:
        return None
    return (
        f"protocol {protocol.name} lasts {protocol.duration_s:g} s, of which a log of {sample_rate_hz:g} Hz takes"
        f" {counted(samples, 'sample')}, and a diagnosis needs {least}: make it longer, or raise"
        " the sample rate"
    )


def _compared(
    columns: Linearised, sd: float, strength: float, limits: Thresholds, hidden: frozenset[str] = frozenset()
) -> Design:
    """The design from columns under noise ``sd``; ``hidden`` effects count as never shown (`Excitation.hides`)."""
    gram = columns.gram[1:, 1:] / sd**2
    own = np.arange(columns.baseline_count)
    projected = gram - gram[:, own] @ np.linalg.pinv(gram[np.ix_(own, own)], rcond=1e-10, hermitian=True) @ gram[own]
    laws = [one for one in columns.candidates if not one.effect.is_flexible]
    names = tuple(dict.fromkeys(one.name for one in laws))
    count = sum(int(session.fitted.sum()) for session in columns.sessions)
    shown = 2.0 * math.log(len(names) / limits.false_name)  # prior odds against an effect, -2 log
    least, unlike = np.full(len(names), np.inf), np.ones((len(names), len(names)))
    firsts = np.array([one.columns[0] - 1 for one in laws])
    powers = np.diag(projected)[firsts]
    seen = powers > 1e-9 * np.diag(gram)[firsts]
    missed = np.array([_not_followed(projected, rival, laws, powers) for rival in laws])
    of = {name: np.array([one.name == name for one in laws]) for name in names}
    for i, name in enumerate(names):
        shapes = of[name] & seen
        if name in hidden or not shapes.any():
            unlike[i] = 0.0
            continue
        # Beyond what the baseline follows it must also be material.
        x = float(powers[shapes].max())
        least[i] = max(math.sqrt(shown / x), limits.material / (sd * math.sqrt(x / count)))
        for j, other in enumerate(names):
            if other not in hidden:
                unlike[i, j] = missed[np.ix_(of[other], shapes)].min() if j != i else 0.0
    return Design(names, least, unlike, strength, count * (strength / sd) ** 2, limits)


def _not_followed(projected: Array, rival: Candidate, targets: Sequence[Candidate], powers: Array) -> Array:
    """(m,) share of the square of each target's first column that a rival leaves, with strengths of a physical sign.

    The sign is not asked of a rival with several strengths, since a fit keeps them within their bounds. ``powers`` (m,)
    are the squares.
    """
    at, firsts = [column - 1 for column in rival.columns], [one.columns[0] - 1 for one in targets]
    across = projected[np.ix_(at, firsts)]
    found = np.linalg.pinv(projected[np.ix_(at, at)], rcond=1e-9, hermitian=True) @ across
    shares = np.clip(1.0 - np.sum(found * across, axis=0) / np.maximum(powers, 1e-300), 0.0, 1.0)
    if len(at) == 1:
        shares[[not _may_follow(rival, one, found[:, k]) for k, one in enumerate(targets)]] = 1.0
    return np.asarray(shares)


def _may_follow(rival: Candidate, target: Candidate, strength: Array) -> bool:
    """Whether a rival's ``strength`` (1,) has a physical sign together with the target's first, or both reversed."""
    first = np.eye(1, len(target.columns))[0]
    return any(target.allows_sign_of(sign * first) and rival.allows_sign_of(sign * strength) for sign in (1.0, -1.0))
