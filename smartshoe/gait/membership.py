"""How much of each gait phase a foot is in: continuous membership from the four loads.

After the idea of Kong and Tomizuka 2009 (IEEE/ASME Trans. Mechatronics 14, 358-370): each load is "large" or "small"
by a smooth step, a phase is a product of these over the four units, and what no phase claims is abnormal. The
numbers are not theirs: the steps here lie at shares of each unit's own median peak, so that body weight and the
strength of a unit do not matter, and the products are divided by their sum.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from smartshoe.arrays import Array

# Regions whose load is large, and regions whose load is small, in each phase; the others may be either.
PHASES: Mapping[str, tuple[frozenset[str], frozenset[str]]] = {
    "initial_contact": (frozenset({"heel"}), frozenset({"meta4", "meta1", "toe"})),
    "loading_response": (frozenset({"heel", "meta4"}), frozenset({"meta1", "toe"})),
    "mid_stance": (frozenset({"heel", "meta4", "meta1"}), frozenset()),
    "terminal_stance": (frozenset({"meta4", "meta1"}), frozenset({"heel"})),
    "pre_swing": (frozenset({"toe"}), frozenset({"heel", "meta4", "meta1"})),
    "swing": (frozenset(), frozenset({"heel", "meta4", "meta1", "toe"})),
}
MIDDLE, WIDTH = 0.15, 0.05  # of a unit's median peak: where "large" begins, and how wide the transition is
SLIGHT = 1e-9


def large(share: Array) -> Array:
    """Degree, 0 to 1, to which a load is large, from its share of the usual peak: 0.5 at `MIDDLE`."""
    return np.asarray(0.5 + 0.5 * np.tanh((share - MIDDLE) / WIDTH))


def memberships(load: Array, regions: Sequence[str], usual_peak: Array) -> tuple[Array, Array]:
    """Membership (n, 6) in `PHASES`, summing to 1, and abnormality (n,), 0 to 1, from loads (n, r).

    ``usual_peak`` (r,) is what each unit usually reaches in a stance; a unit that never bears load (0) counts as small
    in every phase. Abnormality is one minus the sum of the products: near one where the loads fit no phase.
    """
    usual = np.where(usual_peak > 0, usual_peak, np.inf)
    much = large(load / usual)
    products = np.ones((load.shape[0], len(PHASES)))
    for column, (wanted, unwanted) in enumerate(PHASES.values()):
        for index, region in enumerate(regions):
            if region in wanted:
                products[:, column] *= much[:, index]
            elif region in unwanted:
                products[:, column] *= 1.0 - much[:, index]
    whole = products.sum(axis=1)
    return (products + SLIGHT) / (whole + SLIGHT * len(PHASES))[:, None], 1.0 - np.minimum(whole, 1.0)
