"""`Battery`: the field checks of a worn shoe, repeated on the last half minute of its readings."""

from __future__ import annotations

from typing import Any

from smartshoe.errors import SmartShoeError
from smartshoe.gait import analyse
from smartshoe.gait.field.examination import examine
from smartshoe.live._shoe import LiveShoe
from smartshoe.live.session import LiveSession
from smartshoe.recording import Recording

LOOKED_AT_S = 30.0
FEWEST_S = 3.0


class Battery:
    """The current check results of a session's shoes, and the wearer's body weight.

    ``checks`` holds for each shoe a list of objects with verdict ('ok', 'warning', 'fault', 'unknown'), kind, unit and
    a sentence. ``weight`` is the body weight in N with its sd, None if no unit has a calibration or nobody walks.
    """

    def __init__(self, session: LiveSession) -> None:
        self._session = session
        self.checks: list[list[dict[str, Any]]] = [[] for _ in session.shoes]
        self.weight: dict[str, float] | None = None

    def look(self) -> None:
        """Carry out all checks once and store their results."""
        recordings: list[Recording] = []
        checks: list[list[dict[str, Any]]] = []
        for live in self._session.shoes:
            recording = live.recording_of_last(LOOKED_AT_S)
            if recording is None or recording.duration_s < FEWEST_S or live.state in ("away", "silent"):
                checks.append([])
                continue
            recordings.append(recording)
            checks.append(_examined(live, recording))
        self.checks = checks
        self.weight = self._weighed(recordings)

    def forget(self) -> None:
        """Discard all results."""
        self.checks, self.weight = [[] for _ in self._session.shoes], None

    def _weighed(self, recordings: list[Recording]) -> dict[str, float] | None:
        """The body weight in N with its sd, from all shoes' recordings; None if it cannot be found."""
        calibrations = [c for live in self._session.shoes for c in live.calibrations]
        if not calibrations or not recordings:
            return None
        try:
            found = analyse(recordings, calibrations).forces.body_weight
        except SmartShoeError:
            return None  # nobody walks, so no weight can be found
        return None if found is None else {"value": found.value, "sd": found.sd}


def _examined(live: LiveShoe, recording: Recording) -> list[dict[str, Any]]:
    """The findings about one shoe as objects for JSON, without the zero, which is set by a button."""
    try:
        found = examine(recording, live.calibrations)
    except SmartShoeError as error:
        return [{"kind": "checks", "verdict": "unknown", "unit": "", "says": str(error)}]
    return [
        {"kind": f.kind, "verdict": f.verdict, "unit": f.unit, "says": f.says}
        for f in found.findings
        if f.kind != "zero"
    ]
