"""`Diagnosis`: the result of a diagnosis, as an object and as the contract's JSON."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from smartshoe.arrays import Array, Index, Mask, require_positive
from smartshoe.diagnosis._held_out import Gain
from smartshoe.display import Summarised, SummaryTable, panels, percent, significant, sure
from smartshoe.errors import NotIdentifiableError
from smartshoe.integrity import DataFault
from smartshoe.integrity.thresholds import Thresholds, described
from smartshoe.models.effects import Effect, effect, in_words, listed
from smartshoe.models.extended import ExtendedModel
from smartshoe.models.parameter import Parameter, finite_or_none
from smartshoe.protocol import Protocol
from smartshoe.recording import sample_rate_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from smartshoe.calibration import Calibration

Verdict = Literal["adequate", "explained", "partly_explained", "unexplained", "refused"]
# The statistics of statements that say why a cause, or its law, is not sure.
OF_A_DOUBTED_CAUSE, OF_A_KIND = "confidence of its kind", "kind"


@dataclass(frozen=True, slots=True)
class Statement:
    """One piece of evidence: a number, the threshold it is compared with, and a sentence."""

    statistic: str
    value: float
    threshold: float
    says: str

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers."""
        return {
            "statistic": self.statistic,
            "value": finite_or_none(self.value),
            "threshold": finite_or_none(self.threshold),
            "says": self.says,
        }


@dataclass(frozen=True, slots=True)
class Rival:
    """Another effect in a cause's place, whose -2 log probability is higher by ``margin``, lower if that is negative.

    ``by``: for a law of the same kind, the likelihood of a ``fit`` in its place; for another kind, the ``evidence``, in
    which equations may be inexact. The two are not on one scale. Where no cause is named, ``alone``: what it explains
    by itself.
    """

    effect: str
    margin: float
    by: Literal["fit", "evidence", "alone"] = "evidence"

    @property
    def may_be_likelier(self) -> bool:
        """Whether it is at least as probable as the named effect, to the nearest whole number."""
        return self.margin < 0.5

    @property
    def says(self) -> str:
        """How probable it is in the cause's place, as "is less likely by 12"; for a fit, how much worse it fits.

        "Only" where that is less than 10, which is strong evidence.
        """
        size, of_fit = abs(self.margin), self.by == "fit"
        if size < 0.5:
            return "fits as well" if of_fit else "is as likely"
        by = f"{size:,.0f}" if size >= 10.0 else f"{size:.2g}"
        if self.margin > 0.0:
            only = "" if of_fit or size >= 10.0 else "only "
            return f"{'fits worse' if of_fit else 'is less likely'} by {only}{by}"
        return f"{'fits better' if of_fit else 'is likelier'} by {by}"

    def to_dict(self) -> dict[str, Any]:
        """The contract's entry in ``rivals``."""
        return {"effect": self.effect, "margin": finite_or_none(self.margin), "by": self.by}


def likelier_of(rivals: Sequence[Rival], equivalents: Sequence[str]) -> tuple[Rival, ...]:
    """The rivals that are at least as probable in a cause's place and are none of its ``equivalents``."""
    return tuple(one for one in rivals if one.may_be_likelier and one.effect not in equivalents)


@dataclass(frozen=True, eq=False, repr=False)
class Cause:
    """One named effect. ``size`` is the rms by which it moves the reading, a share of full scale.

    ``confidence`` is the probability that it is this effect or one of its ``equivalents``, which this data cannot
    distinguish; ``law_confidence`` that, if so, it is this one and not its nearest rival, one half in a dead heat.
    ``part`` names the effect of the fitted model that it is, itself or a flexible block in its place; None for an
    offset or tare at rest.
    """

    effect: Effect
    confidence: float
    law_confidence: float
    equivalents: tuple[str, ...]
    parameters: dict[str, Parameter]
    evidence: tuple[Statement, ...]
    held_out: Gain
    size: float
    rivals: tuple[Rival, ...] = ()
    part: str | None = None

    def __repr__(self) -> str:
        """One line: the effect, how sure it is, its size and its parameters."""
        name = listed([self.name, *self.equivalents], "or")
        values = ", ".join(
            f"{key} {significant(one.value)}" + (f" {one.unit}" if one.unit != "1" else "")
            for key, one in self.parameters.items()
        )
        size = f"moves the reading by {percent(self.size)} of full scale"
        return f"<Cause {name}, {sure(self.confidence)} sure: {size}; {values}>"

    @property
    def name(self) -> str:
        """The effect's identifier."""
        return self.effect.name

    @property
    def says(self) -> str:
        """What it does to the reading: of a free form as long as laws that bend otherwise cannot be ruled out."""
        part = effect(self.part) if self.part is not None else self.effect
        return part.says if part.is_flexible and self.equivalents else self.effect.says

    @property
    def as_likely(self) -> tuple[Rival, ...]:
        """The rivals that are at least as probable in its place, although nothing else supports them."""
        return likelier_of(self.rivals, self.equivalents)

    @property
    def doubt(self) -> str:
        """Why it, or its law, is not sure, from its evidence; empty where it is sure."""
        return next((one.says for one in self.evidence if one.statistic in (OF_A_DOUBTED_CAUSE, OF_A_KIND)), "")

    def to_dict(self) -> dict[str, Any]:
        """The contract's entry in ``causes``."""
        return {
            "effect": self.effect.name,
            "family": self.effect.family,
            "stage": self.effect.stage,
            "confidence": self.confidence,
            "law_confidence": self.law_confidence,
            "equivalents": list(self.equivalents),
            "parameters": {
                name: {key: value for key, value in parameter.to_dict().items() if key != "sd"}
                for name, parameter in self.parameters.items()
            },
            "evidence": [one.to_dict() for one in self.evidence],
            "held_out": self.held_out.to_dict(),
            "size_percent_of_full_scale": 100.0 * self.size,
            "says": self.says,
        }


@dataclass(frozen=True, slots=True)
class GoodnessOfFit:
    """How a model does on held-out data; ``structure_rms`` is the structure in its residual of all recordings.

    NaN where nothing could be judged; ``structure_rms`` is NaN where no test could have detected any.
    """

    rmse: float
    unit: str
    fit_percent: float
    force_rmse_n: float
    structure_rms: float
    variance_explained_percent: float = 0.0

    def to_dict(self) -> dict[str, Any]:
        """The contract's ``baseline`` and ``extended``."""
        return {
            "rmse": {"value": finite_or_none(self.rmse), "unit": self.unit},
            "fit_percent": finite_or_none(self.fit_percent),
            "force_rmse_n": finite_or_none(self.force_rmse_n),
            "structure_rms": {"value": finite_or_none(self.structure_rms), "unit": self.unit},
            "variance_explained_percent": finite_or_none(self.variance_explained_percent),
        }


@dataclass(frozen=True, slots=True)
class NextExperiment:
    """What would separate the rivals: a protocol to run, with its expected margin, or a channel to log."""

    separates: tuple[str, ...]
    protocol: str | None
    channel: str | None
    says: str
    expected_margin: float | None = None
    steps: Protocol | None = None

    def to_dict(self) -> dict[str, Any]:
        """The contract's ``next_experiment``."""
        return {
            "separates": list(self.separates),
            "protocol": self.protocol,
            "channel": self.channel,
            "says": self.says,
            "expected_margin": None if self.expected_margin is None else finite_or_none(self.expected_margin),
        }


@dataclass(frozen=True, eq=False)
class Trace:
    """One recording at its full rate, for figures: all (n,), reading in ``Diagnosis.unit``, load in N.

    ``recording`` is its index among all that were given, as in a `DataFault`.
    """

    name: str
    time_s: Array
    load_n: Array
    reading: Array
    baseline: Array
    extended: Array
    usable: Mask
    held_out: Mask
    cycle: Index
    recording: int


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosis(Summarised):
    """The result of a diagnosis; `to_dict` is what `smartshoe diagnose --json` writes.

    ``model`` is the extended model and ``baseline_model`` the plain one, None if the diagnosis was refused.
    ``rejected`` is the extended model if ``gain`` shows that it is worse on held-out data; then ``model``, ``extended``
    and ``parameters`` are those of the plain model. ``force_model`` is the plain model with its zero, if its inverse
    gives a better force than that of ``model``, else None; ``extended.force_rmse_n`` is of the model that `calibration`
    compensates by. ``parameters`` are those of all effects of the model, as ``effect.parameter``, with their
    ``covariance``.

    ``minor`` are effects that stay in the model without being causes: immaterial, unsure, cancelled by others, or at a
    bound. ``screening``: effects, and by how much each alone could lower the baseline's score (-2 log likelihood).
    ``leftover`` says where the remaining structure lies.

    ``limits_of_the_force`` are those of the ``limits`` that say where a calibration's force may be off, ``clipped`` the
    share of samples that errors of the force leave out. ``left_out`` says which recordings were, and why; ``limits``
    begin with it.
    """

    verdict: Verdict
    says: str
    unit: str
    full_scale_load_n: float
    full_scale_reading: float
    causes: tuple[Cause, ...] = ()
    minor: tuple[str, ...] = ()
    data_faults: tuple[DataFault, ...] = ()
    baseline: GoodnessOfFit | None = None
    extended: GoodnessOfFit | None = None
    gain: Gain | None = None
    explainable_percent: float = 0.0
    explained_percent: float = 0.0
    rivals: tuple[Rival, ...] = ()
    next_experiment: NextExperiment | None = None
    limits: tuple[str, ...] = ()
    limits_of_the_force: tuple[str, ...] = ()
    clipped: float = 0.0
    left_out: tuple[str, ...] = ()
    leftover: str | None = None
    screening: tuple[tuple[str, float], ...] = ()
    likeness: Array | None = None
    model: ExtendedModel | None = None
    baseline_model: ExtendedModel | None = None
    force_model: ExtendedModel | None = None
    rejected: ExtendedModel | None = None
    traces: tuple[Trace, ...] = field(default=())
    parameters: Mapping[str, Parameter] = field(default_factory=dict)
    covariance: tuple[tuple[float, ...], ...] = ()
    thresholds: Thresholds = field(default_factory=Thresholds)

    @property
    def limits_of_the_rest(self) -> tuple[str, ...]:
        """``limits`` without those that say which recordings were ``left_out``."""
        return self.limits[len(self.left_out) :]

    @property
    def minor_in_words(self) -> str:
        """The effects of the extended model, adopted or rejected, that are no causes; empty if there are none."""
        return listed(sorted(map(in_words, self.minor)), "and")

    @property
    def says_of_minor(self) -> str | None:
        """The sentence on these effects."""
        if not self.minor:
            return None
        which = "extended" if self.rejected is None else "rejected"
        return (
            f"in the {which} model without being causes, too small, too unsure or without a law: {self.minor_in_words}"
        )

    def calibration(self, *, unit: str = "", sample_rate_hz: float | None = None, created: str = "") -> Calibration:
        """The extended model as a calibration, for `compensate`, `export` and a twin.

        At ``sample_rate_hz``, the first recording's where none is given. With a ``force_model`` that one compensates,
        and the extended model is the twin.
        Raises `NotIdentifiableError` where the diagnosis was refused, `UsageError` for a rate that is not positive.
        """
        from smartshoe.calibration import extended_calibration

        if self.model is None:
            raise NotIdentifiableError(f"there is no model to calibrate by: {self.says}")
        rate_hz = self._sample_rate_hz if sample_rate_hz is None else require_positive(sample_rate_hz, "sample_rate_hz")
        made = extended_calibration(
            self.force_model or self.model,
            unit=unit,
            parameters=self.parameters,
            covariance=self.covariance,
            load_range_n=(0.0, self.full_scale_load_n),
            sample_rate_hz=rate_hz,
            created=created,
        )
        return replace(made, twin=self.model) if self.force_model else made

    @property
    def _sample_rate_hz(self) -> float:
        """The sample rate of the first recording."""
        from smartshoe.calibration.provenance import without_rounding

        return without_rounding(sample_rate_of(self.traces[0].time_s))

    def plot(self) -> Figure:
        """A figure: for each recording, the residuals of the baseline and of the extended model over time.

        Raises `NotIdentifiableError` where the diagnosis was refused.
        """
        if not self.traces:
            raise NotIdentifiableError(f"there is no model to plot: {self.says}")
        figure, axes = panels(len(self.traces))
        for axis, trace in zip(axes, self.traces, strict=True):
            for label, simulated, colour in (("baseline", trace.baseline, "0.6"), ("extended", trace.extended, "C0")):
                left = np.where(trace.usable, trace.reading - simulated, np.nan)
                axis.plot(trace.time_s, left, linewidth=0.8, color=colour, label=label)
            axis.set(title=trace.name, xlabel="time (s)", ylabel=f"measured minus model ({self.unit})")
            axis.legend(loc="upper right")
        return figure

    def _summary_table(self) -> SummaryTable:
        rows = [
            [
                in_words(cause.name),
                listed(cause.equivalents, "or") or "–",
                sure(cause.confidence),
                significant(100.0 * cause.size, 3),
                significant(cause.held_out.gain_percent, 3),
            ]
            for cause in self.causes
        ]
        return SummaryTable(
            f"{self.verdict.replace('_', ' ')}: {self.says}",
            ["cause", "or it is", "confidence", "size % of full scale", "gain on held-out data %"],
            rows,
            (
                *(
                    f"fault of the data: {in_words(fault.kind)}, {fault.label}: {fault.says}"
                    for fault in self.data_faults
                ),
                *([said] if (said := self.says_of_minor) else []),
                *([f"what is left: {self.leftover}"] if self.leftover else []),
                *(f"limit: {limit}" for limit in self.limits),
                *([f"next: {self.next_experiment.says}"] if self.next_experiment else []),
            ),
        )

    def to_dict(self) -> dict[str, Any]:
        """Schema ``smartshoe.diagnosis/1``."""
        nothing: dict[str, Any] = {"rmse": {}, "fit_percent": None, "force_rmse_n": None}
        return {
            "schema": "smartshoe.diagnosis/1",
            "verdict": self.verdict,
            "says": self.says,
            "causes": [cause.to_dict() for cause in self.causes],
            "minor_effects": list(self.minor),
            "data_faults": [fault.to_dict() for fault in self.data_faults],
            "baseline": self.baseline.to_dict() if self.baseline else nothing,
            "extended": self.extended.to_dict() if self.extended else nothing,
            "held_out": self.gain.to_dict() if self.gain else None,
            "explainable_percent": finite_or_none(self.explainable_percent),
            "explained_percent": finite_or_none(self.explained_percent),
            "rivals": [rival.to_dict() for rival in self.rivals],
            "next_experiment": self.next_experiment.to_dict() if self.next_experiment else None,
            "limits": list(self.limits),
            "leftover": self.leftover,
            "screening": [{"effect": name, "fall": fall} for name, fall in self.screening],
            "thresholds": described(self.thresholds),
            "model": self.model.to_dict() if self.model else None,
            "rejected": self.rejected.to_dict() if self.rejected else None,
        }
