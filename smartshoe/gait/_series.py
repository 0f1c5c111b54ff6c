"""`FootSeries`: everything that follows from one foot's loads and contacts, sample by sample."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from smartshoe.arrays import Array, Mask
from smartshoe.gait._contact import Contacts
from smartshoe.gait._coverage import Coverage
from smartshoe.gait._trial import Foot
from smartshoe.gait.insole import LEAST_SHARE, centre_of_pressure
from smartshoe.gait.membership import memberships
from smartshoe.gait.phases import crisp


@dataclass(frozen=True, eq=False)
class FootSeries:
    """One foot over time; all arrays are (n,) or (n, r) at the times ``time_s`` (n,).

    ``load`` (n, r) is the load of each unit above its floor, in N if ``is_force``. ``force_n`` (n,) is the force on the
    whole foot, corrected for coverage, None if the loads are not in N. ``sd_n`` (n,) is its error bar from the
    estimator, None without one; it does not include the error of the coverage. ``centre`` (n, 2) is the centre of
    pressure, along and medial, as shares of the insole's length, NaN in swing. ``state`` (n,) is an index into
    `smartshoe.gait.phases.PHASES`. ``membership`` (n, 6) refers to `smartshoe.gait.membership.PHASES`; ``abnormality``
    (n,) is what fits none of them.
    """

    name: str
    time_s: Array
    rate_hz: float
    regions: tuple[str, ...]
    symbol: str
    is_force: bool
    load: Array
    force_n: Array | None
    sd_n: Array | None
    centre: Array
    state: NDArray[np.int8]
    membership: Array
    abnormality: Array
    missing: Mask
    contacts: Contacts
    usual_peak: Array


def series_of(foot: Foot, contacts: Contacts, load: Array, coverage: Coverage, usual_peak: Array) -> FootSeries:
    """The series of ``foot`` from its ``load`` (n, r) above the floor and each unit's usual peak (r,)."""
    membership, abnormality = memberships(load, foot.regions, usual_peak)
    return FootSeries(
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
