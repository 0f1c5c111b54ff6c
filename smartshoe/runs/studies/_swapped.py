"""Finds trials in which left and right seem swapped: their asymmetries mirror those of the subject's other trials."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from smartshoe.runs.studies._trials import TrialFigures

FEWEST = 3  # trials that a subject must have
NOTABLE_PERCENT = 3.0  # rms of a subject's asymmetries; below it left and right are too alike to be told apart
CLEARLY = 3.0  # how many times nearer to the mirror image than to the other trials, and than those scatter


def swapped_trials(trials: Sequence[TrialFigures]) -> list[TrialFigures]:
    """The trials in which left and right seem swapped."""
    found: list[TrialFigures] = []
    for subject in dict.fromkeys(trial.entry.subject for trial in trials):
        own = [trial for trial in trials if trial.entry.subject == subject]
        names = [name for name in own[0].figures if name.startswith("right_over_left_percent.")]
        names = [name for name in names if all(name in trial.figures for trial in own)]
        if len(own) < FEWEST or not names:
            continue
        table = np.array([[trial.figures[name] for name in names] for trial in own])
        for number, trial in enumerate(own):
            others = np.delete(table, number, axis=0)
            middle = np.median(others, axis=0)
            scatter = np.sqrt(np.mean((others - middle) ** 2))
            away, mirrored = (np.sqrt(np.mean((table[number] - each) ** 2)) for each in (middle, -middle))
            is_notable = np.sqrt(np.mean(middle**2)) > NOTABLE_PERCENT
            if is_notable and away > CLEARLY * mirrored and away > CLEARLY * scatter:
                found.append(trial)
    return found
