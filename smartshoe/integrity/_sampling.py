"""Faults that the time base and the masks of missing samples show by themselves: too short, gaps, uneven steps."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from smartshoe.display import moment, percent
from smartshoe.integrity._fault import Finding
from smartshoe.integrity.thresholds import Thresholds, largest_of_noise
from smartshoe.recording import Recording
from smartshoe.signals.masks import runs_of
from smartshoe.signals.noise import robust_sd


def short_recording(recording: Recording, thresholds: Thresholds, is_thinned: bool) -> Iterator[Finding]:
    """Kind ``short_recording``, fatal: too few samples to show anything, or over before a reading answers its load.

    ``is_thinned``: samples were left out, which other findings tell.
    """
    held = f"{len(recording)} samples in {moment(recording.duration_s, 3)} s" if len(recording) > 1 else "one sample"
    if len(recording) < thresholds.least_samples:
        mend = f"give at least {thresholds.least_samples} samples"
    elif recording.duration_s < thresholds.echo_s:
        mend = (
            f"a reading may take {thresholds.echo_s:g} s to answer its load, so give a longer one, or check the unit of"
            " its time"
        )
    else:
        return
    left_out = ", without those that are no measurements of their own" if is_thinned else ""
    says = f"the recording holds {held}{left_out}: {mend}"
    yield Finding.fatal("short_recording", np.ones(len(recording), dtype=bool), says)


def missing_samples(recording: Recording, thresholds: Thresholds) -> Iterator[Finding]:
    """Kind ``missing_samples``; masked: rows in which load or reading is missing. One finding a channel."""
    for role, what in (("load", "reference load"), ("sensor", "reading")):
        for channel in recording.of_role(role):  # type: ignore[arg-type]
            absent = ~channel.present
            if not absent.any():
                continue
            starts, stops = runs_of(absent)
            count, longest = int(absent.sum()), int((stops - starts).max())
            if count == 1:
                found = "one sample: it is left out"
            elif starts.size == 1:
                found = f"{count} samples in a row: they are left out"
            elif longest == 1:
                found = f"{count} samples, each alone: they are left out"
            else:
                found = f"{count} samples, in {starts.size} stretches of up to {longest}: they are left out"
            yield Finding(
                "missing_samples",
                absent,
                f"the {what} {channel.name} is missing in {found}",
                "minor" if absent.mean() < thresholds.faulty_share else "material",
                True,
            )


def gaps(recording: Recording, thresholds: Thresholds) -> Iterator[Finding]:
    """Kind ``gaps``: steps of time in which rows are missing. Samples beside a gap stay in use."""
    step = np.diff(recording.time_s)
    usual = float(np.median(step))
    # A sample is missing from one and a half steps on, where steps are even enough to tell. Steps are positive and
    # scatter by ratios: in a log without a clock one step in a thousand is several times the usual one.
    ratio = np.log(step / usual)
    wide = ratio > max(math.log(1.5), largest_of_noise(step.size, thresholds) * robust_sd(ratio))
    # A larger share of such steps is how the logger works, and is reported as uneven sampling.
    if not wide.any() or wide.mean() > thresholds.faulty_share:
        return
    lost = int(np.rint(step[wide] / usual - 1.0).sum())
    at = np.zeros(len(recording), dtype=bool)
    at[1:][wide] = True
    at[:-1][wide] = True
    share, longest_s = lost / (lost + len(recording)), f"{moment(float(step.max()), 3)} s"
    yield Finding(
        "gaps",
        at,
        f"{f'a gap of {longest_s}' if wide.sum() == 1 else f'{int(wide.sum())} gaps in time, the longest {longest_s}'}:"
        f" about {f'{lost} samples' if lost > 1 else 'one sample'} ({percent(share)} of all) missing",
        "minor" if share < thresholds.faulty_share else "material",
    )


def uneven_sampling(recording: Recording, thresholds: Thresholds) -> Iterator[Finding]:
    """Kind ``uneven_sampling``: the steps differ throughout the recording, or the sampling rate changes."""
    step = np.diff(recording.time_s)
    usual = float(np.median(step))
    away = np.abs(step - usual) / usual
    typical = float(np.quantile(away, 1.0 - thresholds.faulty_share))
    if typical <= thresholds.same:
        return
    is_uneven = away > thresholds.same
    yield Finding(
        "uneven_sampling",
        np.concatenate([[False], is_uneven]),
        f"the sampling step varies: {percent(float(is_uneven.mean()))} of the steps differ from the usual"
        f" {usual:.4g} s by more than {100 * thresholds.same:.0f} %"
        f" (from {float(step.min()):.3g} to {moment(float(step.max()), 3)} s)",
    )
