"""A foot's course: everything that is told of it against time, from its loads and contacts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from smartshoe.gait.contact import Contacts
from smartshoe.gait.coverage import Coverage
from smartshoe.gait.insole import LEAST_SHARE, centre_of_pressure
from smartshoe.gait.membership import memberships
from smartshoe.gait.phases import crisp
from smartshoe.gait.result import FootCourse
from smartshoe.gait.trial import Foot

Array = NDArray[np.float64]


def course_of(foot: Foot, contacts: Contacts, load: Array, coverage: Coverage, usual_peak: Array) -> FootCourse:
    """The course of ``foot`` with the ``load`` (n, r) above its floor; ``usual_peak`` (r,) of its units."""
    membership, abnormality = memberships(load, foot.regions, usual_peak)
    return FootCourse(
        name=foot.name,
        time_s=foot.time_s,
        rate_hz=foot.rate_hz,
        regions=foot.regions,
        symbol=foot.units[0].symbol,
        is_force=foot.is_force,
        load=load,
        sd_n=None if foot.sd_n is None else foot.sd_n / coverage.share,
        force_n=coverage.whole(load.sum(axis=1), foot.time_s, contacts) if foot.is_force else None,
        centre=centre_of_pressure(load, foot.regions, LEAST_SHARE * float(usual_peak.sum())),
        state=crisp(contacts, foot.time_s),
        membership=membership,
        abnormality=abnormality,
        missing=foot.missing,
        contacts=contacts,
        usual_peak=usual_peak,
    )
