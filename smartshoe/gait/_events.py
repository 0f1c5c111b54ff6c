"""Gait events: heel strike, foot flat, heel off and toe off, listed from a foot's contacts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from smartshoe.gait._contact import Contacts


@dataclass(frozen=True, slots=True)
class Event:
    """A gait event of one foot: ``event`` is heel_strike, foot_flat, heel_off or toe_off."""

    time_s: float
    foot: str
    event: str


def events_of(contacts: Mapping[str, Contacts]) -> list[Event]:
    """The events of each foot's contacts, in order of time."""
    found = [
        Event(float(at), foot, name)
        for foot, own in contacts.items()
        for name, times in (
            ("heel_strike", own.strike_s),
            ("foot_flat", own.foot_flat_s),
            ("heel_off", own.heel_off_s),
            ("toe_off", own.toe_off_s),
        )
        for at in times[np.isfinite(times)]
    ]
    return sorted(found, key=lambda event: (event.time_s, event.foot, event.event))
