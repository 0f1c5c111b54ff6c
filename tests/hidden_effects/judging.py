"""How an answer is judged, alike in every world, by nothing but what `Diagnosis.to_dict` makes public.

- *exact*: the hidden effect is named first; only nuisances, conditions (by effect or family) and noise may come before
  it. It counts as well where it is among the `equivalents` of a cause that it cannot be told from (the truth's
  `cannot_be_told_from`). Faults of data, noise, saturation and timing may stand among the data faults. Several effects:
  all are named, each by a cause of its own, and no name is false. An effect that amounts to less than 0.15 % beside
  others is not asked for.
- *family*: the hidden families are named.
- *verdict*: `explained` or `partly_explained` where effects of the catalogue are hidden (or `adequate` for noise and
  faults), `unexplained` or `partly_explained` for those outside of it; without an effect `adequate`, or `explained` by
  what is there, and it must be that where a tare or an offset of 0.15 % and more is there.
- *false names*: causes that are neither hidden nor a nuisance or condition, by effect or family. A second name in the
  hidden family is a *companion*, counted apart.
- *confidence*: right is a cause that is neither false nor a companion. By its own words it is right as well where what
  is there is among its `equivalents`, whatever else could be told (`said_names`). That of the *law*, of the causes that
  are right: it is the very effect that is there, hidden or not.
- *explained*: of the held-out variance that could be explained, 1 - (extended^2 - noise^2)/(baseline^2 - noise^2). A
  fault of the data or noise that is hidden alone is nothing that a model could explain.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

LEAST_PERCENT = 0.15  # of full scale: what an effect beside others, a tare or an offset must amount to
FAULT_IS = {
    "two_clocks": {"delay", "clock_drift", "sensor_lag"}, "low_rail": {"saturation", "dropouts"},
    "gaps": {"dropouts"}, "missing_samples": {"dropouts"},
}  # fmt: skip
AS_FAULTS = frozenset({"data", "noise", "saturation", "timing"})  # may stand among the data faults
SOFT = frozenset({"data", "noise"})
ALWAYS_THERE = frozenset({"coloured_noise", "quantisation"})  # every case has a little of both
OUTSIDE_KINDS = frozenset({"outside", "unknown"})
SURE = 0.5
EXPLAINABLE = 1.1  # times the noise: a baseline's error below it leaves nothing to explain

Found = Mapping[str, Any]


@dataclass
class Judgement:
    """One answer judged; ``names`` are (confidence, right) of each cause, ``laws`` those of its law.

    ``said_names``: right as well where an equivalent is there, which is what the confidence is said to be of.
    """

    exact: bool = False
    all_named: bool = False
    family: bool = False
    verdict: bool = False
    false: list[str] = field(default_factory=list)
    sure_false: list[str] = field(default_factory=list)
    companions: list[str] = field(default_factory=list)
    false_faults: list[str] = field(default_factory=list)
    hedges: int = 0
    names: list[tuple[float, bool]] = field(default_factory=list)
    said_names: list[tuple[float, bool]] = field(default_factory=list)
    laws: list[tuple[float, bool]] = field(default_factory=list)
    explained: float | None = None
    worse: bool = False
    rejected: bool = False
    raised: bool = False
    said: str = ""


def is_it(cause: Found, effect: Found) -> bool:
    """Whether a cause names the effect, or one that cannot be told from it, with the effect among its equivalents."""
    if cause["effect"] == effect["id"]:
        return True
    return cause["effect"] in effect["cannot_be_told_from"] and effect["id"] in (cause.get("equivalents") or ())


def judge(row: Found) -> Judgement:
    """The judgement of a row: its ``truth``, its ``found`` and, where known, its ``noise_rmse``."""
    truth, found = row["truth"], row["found"]
    if "verdict" not in found:
        return Judgement(said=found.get("error", "nothing"), raised=True)
    out = Judgement(said=said(found))
    real, causes = truth["effects"], found["causes"]
    names, families = _around(truth)
    asked = [e for e in real if e["family"] == "data" or len(real) == 1 or _amounts_to(e) >= LEAST_PERCENT]
    meant = _meant(found)
    hits = _hits(asked, causes, meant)
    for cause in causes:
        _sort_in(out, cause, real, names, families)
    if truth["kind"] in OUTSIDE_KINDS:
        out.verdict = found["verdict"] in ("unexplained", "partly_explained")
        out.exact = out.verdict and not out.sure_false
    elif not real:
        loud = max((v["strength_percent"] or 0.0 for v in truth["conditions"]), default=0.0)
        out.exact = not out.false
        out.verdict = not out.false and (
            found["verdict"] == "explained" or (found["verdict"] == "adequate" and loud < LEAST_PERCENT)
        )
    else:
        _judge_hidden(out, asked, hits, causes, found["verdict"], names, families)
    there = names | {e["id"] for e in real} | ALWAYS_THERE
    loud_faults = {f["kind"] for f in found["data_faults"] if f.get("severity") != "minor"} - ALWAYS_THERE
    out.false_faults = sorted(k for k in loud_faults if not ({k} | FAULT_IS.get(k, set())) & there)
    _held_out(out, row)
    return out


def _around(truth: Found) -> tuple[set[str], set[str]]:
    """Names and families of the small imperfections and conditions that are there."""
    there = [*truth["nuisances"], *truth["conditions"]]
    names = {v["effect"] for v in there} | {n for v in there for n in v.get("cannot_be_told_from", ())}
    families = {v["family"] for v in there}
    if truth.get("zero", "seen") != "seen" and names & {"zero_offset", "load_cell_tare"}:
        families |= {"zero", "tare"}
    return names, families


def _amounts_to(effect: Found) -> float:
    return float(min(effect["strength_percent"], effect.get("beside", 99.0)))


def _meant(found: Found) -> set[str]:
    kinds = {fault["kind"] for fault in found["data_faults"]}
    return kinds.union(*(FAULT_IS.get(kind, set()) for kind in kinds)) if kinds else kinds


def _hits(asked: list[Found], causes: list[Found], meant: set[str]) -> list[Found | bool]:
    hits: list[Found | bool] = []
    for effect in asked:
        hit = next((c for c in causes if is_it(c, effect) and not any(c is other for other in hits)), None)
        hits.append(hit if hit is not None else effect["family"] in AS_FAULTS and effect["id"] in meant)
    return hits


def _sort_in(out: Judgement, cause: Found, real: list[Found], names: set[str], families: set[str]) -> None:
    there = names | {e["id"] for e in real}
    right = any(is_it(cause, e) for e in real) or cause["effect"] in names or cause["family"] in families
    if not right and cause["family"] in {e["family"] for e in real}:
        out.companions.append(cause["effect"])
    elif not right and cause["family"] != "noise":
        out.false.append(cause["effect"])
        if cause["confidence"] > SURE:
            out.sure_false.append(cause["effect"])
    confidence = float(cause["confidence"])
    out.names.append((confidence, right))
    out.said_names.append((confidence, right or not there.isdisjoint(cause.get("equivalents") or ())))
    if right and "law_confidence" in cause:
        out.laws.append((float(cause["law_confidence"]), cause["effect"] in there))
    for effect in real:
        if cause["effect"] == effect["id"]:
            out.hedges += sum(q not in effect["cannot_be_told_from"] for q in cause.get("equivalents") or ())


def _judge_hidden(
    out: Judgement, asked: list[Found], hits: list[Found | bool], causes: list[Found], verdict: str, names: set[str],
    families: set[str],
) -> None:  # fmt: skip
    soft = all(effect["family"] in SOFT for effect in asked)
    out.verdict = verdict in ("explained", "partly_explained") or (soft and verdict == "adequate")
    got = {c["family"] for c in causes} | {e["family"] for e, hit in zip(asked, hits, strict=True) if hit}
    out.family = {e["family"] for e in asked} <= got
    out.all_named = bool(hits) and all(bool(hit) for hit in hits)
    out.exact = out.all_named and (len(asked) == 1 or not out.false)
    if len(asked) == 1 and isinstance(hits[0], Mapping):
        ahead = causes[: next(i for i, c in enumerate(causes) if c is hits[0])]
        out.exact = all(c["effect"] in names or c["family"] in families | {"noise"} for c in ahead)


def _held_out(out: Judgement, row: Found) -> None:
    found = row["found"]
    before, after = (_rmse(found.get(key)) for key in ("baseline", "extended"))
    if before is None or after is None:
        return
    out.worse = after > before * (1.0 + 1e-6)
    out.rejected = found.get("rejected") is not None
    noise, effects = row.get("noise_rmse"), row["truth"]["effects"]
    only_faults = bool(effects) and all(effect["family"] in SOFT for effect in effects)
    if noise is None or only_faults or before <= EXPLAINABLE * noise:
        return
    out.explained = 1.0 - max(after**2 - noise**2, 0.0) / (before**2 - noise**2)


def _rmse(judged: Found | None) -> float | None:
    value = (judged or {}).get("rmse")
    value = value.get("value") if isinstance(value, Mapping) else value
    return None if value is None else float(value)


def said(found: Found) -> str:
    """The answer in one line."""
    named = ", ".join(
        f"{c['effect']} {c['confidence']:.2f}"
        + (f" (or {', '.join(c['equivalents'])})" if c.get("equivalents") else "")
        for c in found["causes"]
    )
    faults = sorted({f["kind"] for f in found["data_faults"] if f.get("severity") != "minor"} - ALWAYS_THERE)
    return f"{found['verdict']}: {named or '-'}" + (f" [{', '.join(faults)}]" if faults else "")
