"""The four distinct phases of a stride, separated by the gait events."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from smartshoe.arrays import Array
from smartshoe.gait._contact import Contacts

States = NDArray[np.int8]

PHASES = ("swing", "heel", "flat", "push")
SWING, HEEL, FLAT, PUSH = range(4)


def crisp(contacts: Contacts, time_s: Array) -> States:
    """The state (n,) at the times (n,), as an index into `PHASES`.

    The order is swing, heel (from heel strike to foot flat), flat (to heel off), push (to toe off). A stance without
    foot flat has no heel phase, one without heel off no push phase.
    """
    state = np.zeros(time_s.size, dtype=np.int8)
    if len(contacts) == 0:
        return state
    strike_s = np.where(np.isfinite(contacts.strike_s), contacts.strike_s, time_s[0])
    toe_off_s = np.where(np.isfinite(contacts.toe_off_s), contacts.toe_off_s, np.inf)
    # A stance cut off by the record's end may have its foot flat later; a complete one without it began flat.
    unseen_s = np.where(np.isfinite(contacts.toe_off_s), strike_s, np.inf)
    flat_s = np.where(np.isfinite(contacts.foot_flat_s), contacts.foot_flat_s, unseen_s)
    heel_off_s = np.where(np.isfinite(contacts.heel_off_s), contacts.heel_off_s, toe_off_s)
    # If the events are out of order the later one is moved; the index of sequence errors reports that.
    flat_s = np.clip(flat_s, strike_s, heel_off_s)
    which = np.searchsorted(strike_s, time_s, side="right") - 1
    on = which >= 0
    k = np.maximum(which, 0)
    on &= time_s < toe_off_s[k]
    state[on] = HEEL
    state[on & (time_s >= flat_s[k])] = FLAT
    state[on & (time_s >= heel_off_s[k])] = PUSH
    return state
