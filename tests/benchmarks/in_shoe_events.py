"""Events by seven published in-shoe algorithms and by ours, on the same loads; errors against what truly was.

The peers (Blades et al., Sensors 2023, 23, 2736) are loaded from their own file. They take one foot's summed load in
percent of its most; where one has a threshold it gets the best of a grid, for each case anew, which its user would not
have: so the comparison leans their way. Their other settings are their defaults.
"""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simulators.people import Person, Run, Walk, trial
from simulators.people import measured as feet_of
from smartshoe.gait import analyse
from smartshoe.recording import Recording

Array = NDArray[np.float64]
Found = tuple[Array, Array]  # times in s of contacts and offs

RATE_HZ = 200.0  # what the peers are written for
LIKE_S = 0.1  # further apart, they are not the same event
EDGE_S = 1.2  # at either end of a recording, where an event counts for nothing
THRESHOLDS = (1.0, 2.0, 3.0, 5.0, 10.0, 20.0)  # percent of the largest load
PAIRED = (2.0, 5.0, 10.0, 20.0)  # of the algorithm with one for contacts and one for offs
TRUTH_HZ = 1800.0  # of which the plates' rates are parts
REPEATS = 12  # of a plates' recording, which holds a few stances
REST_S = 0.6  # between the repeats
OURS = "smartshoe"
PLATES = ("walk1.forces", "walk2.forces", "Gait.c3d", "grf_run.mot", "jump1.txt", "jump2.txt")


@dataclass(frozen=True, eq=False)
class EventCase:
    """A recording of loads in N; ``contact_s`` and ``off_s`` by foot, the true load of each foot's units (n,)."""

    name: str
    recording: Recording
    contact_s: dict[str, Array]
    off_s: dict[str, Array]
    borne_n: dict[str, Array]

    def foot_n(self, foot: str) -> Array:
        """What the foot's units read together (n,)."""
        return np.sum([c.values for c in self.recording.sensors if c.name.startswith(foot)], axis=0)


@dataclass(frozen=True)
class EventScore:
    """Mean absolute errors of an algorithm; NaN where it found nothing. ``impulse_percent`` is between its events."""

    contact_ms: float
    off_ms: float
    missed_percent: float
    false_percent: float
    stance_ms: float
    impulse_percent: float


def cases(plates: Path | None) -> Iterator[EventCase]:
    """Simulated walks and runs, level and drifting by 5 % of body weight, and plates spread over the insole."""
    for number, activity in enumerate((Walk(0.8), Walk(1.3), Walk(1.8), Run(2.68), Run(3.5))):
        for drift in (0.0, 0.05):
            kind = "walk" if isinstance(activity, Walk) else "run"
            name = f"{kind} {activity.speed_m_per_s:g} m/s, {'drifting' if drift else 'level'}"
            yield _case(name, 100 + number, person=Person(), activity=activity, duration_s=25.0, drift=drift)
    for name in PLATES if plates is not None else ():
        yield _repeated(_case(f"plates {name}", 7, activity=feet_of(plates / name)))


def _case(name: str, seed: int, **told: Any) -> EventCase:
    """The recording at the shoe's rate; its events from a finer grid, since they fall between samples."""
    made, fine = (
        trial(rng=np.random.default_rng(seed), sensors=False, noise_n=1.0, sample_rate_hz=rate_hz, **told)
        for rate_hz in (RATE_HZ, TRUTH_HZ)
    )
    feet = ("left", "right")
    return EventCase(
        name,
        made.recording,
        {foot: fine.times_s(foot, "heel_strike") for foot in feet},
        {foot: fine.times_s(foot, "toe_off") for foot in feet},
        {foot: np.sum([made.unit_n[unit] for unit in made.unit_n if unit.startswith(foot)], axis=0) for foot in feet},
    )


def _repeated(case: EventCase) -> EventCase:
    """The case several times, with rests: the peers give up the last events of a recording, some of them five."""
    rest = round(REST_S * RATE_HZ)
    count = len(case.recording) + 2 * rest
    starts = np.arange(REPEATS) * count + rest
    rng = np.random.default_rng(3)

    def tiled(values: Array, noise: float) -> Array:
        padded = np.zeros(REPEATS * count)
        for start in starts:
            padded[start : start + values.size] = values
        return padded + noise * rng.standard_normal(padded.size) * (padded == 0.0)

    def moved(times_s: Array) -> Array:
        return np.concatenate([times_s + start / RATE_HZ for start in starts]) if times_s.size else times_s

    columns = {f"{channel.name}_n": tiled(channel.values, 1.0) for channel in case.recording.sensors}
    recording = Recording.from_arrays(time_s=np.arange(REPEATS * count) / RATE_HZ, name="plates", **columns)
    return EventCase(
        case.name,
        recording,
        {foot: moved(times_s) for foot, times_s in case.contact_s.items()},
        {foot: moved(times_s) for foot, times_s in case.off_s.items()},
        {foot: tiled(load_n, 0.0) for foot, load_n in case.borne_n.items()},
    )


def load_peers(path: Path) -> dict[str, Callable[[Array], list[Found]]]:
    """The seven by name: from a foot's load in percent to what they find, once for each threshold they may have."""
    spec = importlib.util.spec_from_file_location("in_shoe_event_peers", path)
    assert spec is not None
    assert spec.loader is not None
    theirs = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = theirs
    spec.loader.exec_module(theirs)
    # Their file calls two functions that it does not hold; by name and arguments they do this.
    vars(theirs).update(peaks_wait_time=_apart, fc_fo_delete=_paired)

    def timed(function: Callable[..., Any], *settings: Any) -> Callable[[Array], list[Found]]:
        def found(load: Array) -> list[Found]:
            try:
                contact, off = function(load, *settings)
            except (IndexError, ValueError):
                return [(np.zeros(0), np.zeros(0))]  # it does not get through this recording
            return [(np.asarray(contact, dtype=float) / RATE_HZ, np.asarray(off, dtype=float) / RATE_HZ)]

        return found

    def best_of(*each: Callable[[Array], list[Found]]) -> Callable[[Array], list[Found]]:
        return lambda load: [found for one in each for found in one(load)]

    one, two = theirs.threshold_crossing_fce, theirs.threshold_crossing_two_fce
    return {
        "threshold": best_of(*(timed(one, level) for level in THRESHOLDS)),
        "two thresholds": best_of(*(timed(two, on, off) for on in PAIRED for off in PAIRED if on != off)),
        "first derivative": timed(theirs.first_derivative_fce, RATE_HZ),
        "slope extension": timed(theirs.slope_extension_fce),
        "filtered unity": timed(theirs.filtered_signal_unity_fce),
        "Harle": timed(theirs.harle_fce_method),
        "Mann": timed(theirs.mann_fce_method),
    }


def _apart(contact: Array, off: Array, wait: int) -> Found:
    """Events of a kind no nearer than ``wait`` samples: of two, the first stays."""

    def kept(events: Array) -> Array:
        stays: list[float] = []
        for event in np.asarray(events, dtype=float):
            if not stays or event - stays[-1] > wait:
                stays.append(float(event))
        return np.array(stays, dtype=np.asarray(events).dtype if np.size(events) else float)

    return kept(contact), kept(off)


def _paired(contact: Array, off: Array) -> Found:
    """From the first contact on, and to the last off."""
    contact, off = np.asarray(contact), np.asarray(off)
    if contact.size and off.size:
        off = off[off > contact[0]]
        contact = contact[contact < off[-1]] if off.size else contact
    return contact, off


def scores_of(case: EventCase, peers: dict[str, Callable[[Array], list[Found]]]) -> dict[str, EventScore]:
    """Each algorithm's errors in a case, ours first."""
    found = analyse([case.recording])
    times = {
        (foot, event): np.array([e.time_s for e in found.events if e.foot == foot and e.event == event])
        for foot in case.contact_s
        for event in ("heel_strike", "toe_off")
    }
    ours = {foot: (times[foot, "heel_strike"], times[foot, "toe_off"]) for foot in case.contact_s}
    scores = {OURS: _score(case, ours)}
    for name, peer in peers.items():
        tries = {foot: peer(_percent(case.foot_n(foot))) for foot in case.contact_s}
        every = [_score(case, {foot: tries[foot][n] for foot in tries}) for n in range(min(map(len, tries.values())))]
        scores[name] = min(every, key=_badness)
    return scores


def _percent(load_n: Array) -> Array:
    return 100.0 * (load_n - load_n.min()) / float(np.ptp(load_n))


def _badness(score: EventScore) -> tuple[float, float]:
    """Fewest wrong events first, then the smallest errors."""
    errors = score.contact_ms + score.off_ms
    return score.missed_percent + score.false_percent, errors if np.isfinite(errors) else np.inf


def _score(case: EventCase, found: dict[str, Found]) -> EventScore:
    contact, off, stance, impulse = [], [], [], []
    true = missed = false = 0
    end_s = float(case.recording.time_s[-1]) - EDGE_S
    for foot, (found_contact_s, found_off_s) in found.items():
        load_n = np.concatenate([[0.0], np.cumsum(case.borne_n[foot]) / RATE_HZ])
        matched: list[dict[int, float]] = []
        for true_s, found_s, errors in (
            (case.contact_s[foot], np.sort(found_contact_s), contact),
            (case.off_s[foot], np.sort(found_off_s), off),
        ):
            own: dict[int, float] = {}
            for number, at_s in enumerate(true_s):
                if not EDGE_S < at_s < end_s:
                    continue
                true += 1
                near = found_s[np.abs(found_s - at_s) < LIKE_S]
                if near.size:
                    own[number] = float(near[np.abs(near - at_s).argmin()])
                    errors.append(abs(own[number] - at_s))
                else:
                    missed += 1
            inside = found_s[(found_s > EDGE_S) & (found_s < end_s)]
            false += inside.size - sum(EDGE_S < at_s < end_s for at_s in own.values())
            matched.append(own)
        for number, begin_s in matched[0].items():
            true_begin_s = case.contact_s[foot][number]
            later = np.flatnonzero(case.off_s[foot] > true_begin_s)
            if later.size and int(later[0]) in matched[1]:
                true_end_s, found_end_s = case.off_s[foot][later[0]], matched[1][int(later[0])]
                stance.append(abs((found_end_s - begin_s) - (true_end_s - true_begin_s)))
                whole, own_impulse = (
                    float(np.diff(np.interp([a * RATE_HZ, b * RATE_HZ], np.arange(load_n.size), load_n))[0])
                    for a, b in ((true_begin_s, true_end_s), (begin_s, found_end_s))
                )
                impulse.append(abs(own_impulse / whole - 1.0))
    return EventScore(
        1e3 * _mean(contact), 1e3 * _mean(off), 100.0 * missed / max(true, 1), 100.0 * max(false, 0) / max(true, 1),
        1e3 * _mean(stance), 100.0 * _mean(impulse),
    )  # fmt: skip


def _mean(values: list[float]) -> float:
    return float(np.mean(values)) if values else float("nan")


def page(results: dict[str, dict[str, EventScore]]) -> str:
    """The page of the comparison, as Markdown."""
    columns = {
        "contact_ms": "contact (ms)", "off_ms": "off (ms)", "missed_percent": "missed (%)",
        "false_percent": "false (%)", "stance_ms": "stance (ms)", "impulse_percent": "impulse (%)",
    }  # fmt: skip
    lines = [
        "# Events against seven published in-shoe algorithms",
        "",
        "Made by `pytest -m benchmark tests/benchmarks/test_in_shoe_events_benchmark.py --events-page PATH`; not edited"
        " by hand. The peers are those that Blades et al. compared (Sensors 2023, 23, 2736), by their own code, on the"
        " load of a foot's four units. Where a peer has a threshold it is given the best of a grid, for each recording"
        " anew. Mean absolute errors against the moments at which the foot's whole true load crosses 2 % of body weight"
        " (10 to 15 N), between samples; loads carry 1 N of noise a unit."
        " *Missed* and *false* are shares of all contacts and offs; *stance* and *impulse* compare what lies"
        " between a contact and its off. Bold: the best of the column among those that miss or invent no more than 2 %"
        " (– : nothing was found).",
        "",
        "A plates' recording holds a few stances; it is spread over the insole by the simulator's shares of regions,"
        " and repeated with rests, since some of the peers give up a recording's last five events. The peers' file"
        " calls two functions that it does not hold (events too near each other; unpaired events): they are written"
        " here by their names. Jumps are no gait: our detector tells contacts by the swings between them, and takes a"
        " flight that lasts less than a swing for none. They stand here because the plates do."
        " A stance that begins before the plates' recording or ends after it counts as *false* for every"
        " algorithm alike. Of the other files that came with these, one holds a single stance, which does not tell body"
        " weight (`BiomecII2018_gait_n.txt`), two have no times (`GRFZjump`), and one no load (`kistler_fp_data.txt`).",
    ]
    for case, scores in results.items():
        sound = [s for s in scores.values() if s.missed_percent <= 2.0 and s.false_percent <= 2.0] or [*scores.values()]
        lines += ["", f"## {case}", "", f"| algorithm | {' | '.join(columns.values())} |", "| --- " * 7 + "|"]
        for name, score in scores.items():
            cells = []
            for column in columns:
                value = getattr(score, column)
                text = "–" if np.isnan(value) else f"{value:.1f}"
                best = min((getattr(s, column) for s in sound), default=np.nan)
                cells.append(f"**{text}**" if score in sound and round(value, 1) <= round(best, 1) else text)
            lines.append(f"| {name} | {' | '.join(cells)} |")
        lines += ["", _not_first(scores, sound, columns)]
    return "\n".join(lines) + "\n"


def _not_first(scores: dict[str, EventScore], sound: list[EventScore], columns: dict[str, str]) -> str:
    """In which columns ours is not the first, who is, and whether that one chose its threshold by the answer."""
    told = []
    for column, heading in columns.items():
        others = {name: getattr(s, column) for name, s in scores.items() if name != OURS and s in sound}
        first = min(others, key=lambda name: np.nan_to_num(others[name], nan=np.inf), default=None)
        if first is not None and round(others[first], 1) < round(getattr(scores[OURS], column), 1):
            chosen = ", its level chosen by the answer" if "threshold" in first else ""
            told.append(f"{heading} ({first}{chosen})")
    return (
        f"Ours is not first in: {'; '.join(told)}."
        if told
        else "Ours is first, or level with the first, in each column."
    )
