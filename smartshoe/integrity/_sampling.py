"""What the time base and the masks of missing samples say by themselves."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from smartshoe.integrity._fault import Finding
from smartshoe.recording import Recording
from smartshoe.signals.masks import runs_of

LEAST_SAMPLES = 100
LEAST_DURATION_S = 1.0
GAP = 1.6  # of the usual step
UNEVEN = 0.2  # of the usual step, for a twentieth of all steps
SMALL_SHARE = 0.001


def short_recording(recording: Recording) -> Iterator[Finding]:
    """Kind ``short_recording``: fatal, since so little shows nothing."""
    if len(recording) >= LEAST_SAMPLES and recording.duration_s >= LEAST_DURATION_S:
        return
    says = (
        f"the recording holds {len(recording)} samples in {recording.duration_s:.3g} s: give at least"
        f" {LEAST_SAMPLES} samples and {LEAST_DURATION_S:g} s"
    )
    yield Finding("short_recording", np.ones(len(recording), dtype=bool), says, "fatal", True, says)


def missing_samples(recording: Recording) -> Iterator[Finding]:
    """Kind ``missing_samples``: rows in which load or reading was not there; masked."""
    for role, what in (("load", "reference load"), ("sensor", "reading")):
        for channel in recording.of_role(role):  # type: ignore[arg-type]
            absent = ~channel.present
            if not absent.any():
                continue
            starts, stops = runs_of(absent)
            longest = int((stops - starts).max())
            yield Finding(
                "missing_samples",
                absent,
                f"the {what} {channel.name} is missing in {int(absent.sum())} samples, in {starts.size} stretches of"
                f" up to {longest}: they are left out",
                "minor" if absent.mean() < SMALL_SHARE else "material",
                True,
            )


def gaps(recording: Recording) -> Iterator[Finding]:
    """Kind ``gaps``: steps of time in which rows are missing; what lies beside a gap stays in use."""
    if len(recording) < 3:
        return
    step = np.diff(recording.time_s)
    usual = float(np.median(step))
    spread = 1.4826 * float(np.median(np.abs(step - usual)))
    wide = step > max(GAP * usual, usual + 8.0 * spread)
    # More than one in twenty such steps is how the logger works, which uneven sampling says.
    if not wide.any() or wide.mean() > 0.05:
        return
    lost = int(np.rint(step[wide] / usual - 1.0).sum())
    at = np.zeros(len(recording), dtype=bool)
    at[1:][wide] = True
    at[:-1][wide] = True
    share = lost / (lost + len(recording))
    yield Finding(
        "gaps",
        at,
        f"time has {int(wide.sum())} gaps, of up to {float(step.max()):.3g} s, in which about {lost} samples"
        f" ({100 * share:.2g} %) are missing",
        "minor" if share < SMALL_SHARE else "material",
    )


def uneven_sampling(recording: Recording) -> Iterator[Finding]:
    """Kind ``uneven_sampling``: steps that differ by more than a fifth all along, or a rate that changes."""
    if len(recording) < 20:
        return
    step = np.diff(recording.time_s)
    usual = float(np.median(step))
    away = np.abs(step - usual) / usual
    typical = float(np.quantile(away, 0.95))
    if typical <= UNEVEN:
        return
    at = np.concatenate([[False], away > UNEVEN])
    yield Finding(
        "uneven_sampling",
        at,
        f"the sampling step varies: {100 * float(at.mean()):.2g} % of the steps differ from the usual"
        f" {usual:.4g} s by more than a fifth (from {float(step.min()):.3g} to {float(step.max()):.3g} s)",
    )
