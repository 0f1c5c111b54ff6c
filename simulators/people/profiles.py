"""A shoe's gait options as a plan of `simulators.people`: walk, run, stand, tiptoe."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simulators.people._speed import WALK_RATIO_M_MIN
from simulators.people.person import BODY_WEIGHT_N, Activity, Part, Person, Run, Stand, Tiptoe, Walk
from simulators.people.plan import GaitPlan, plan
from simulators.people.shape import Outside

FLAT_BEFORE_S, FLAT_AFTER_S = 2.0, 2.0
TIPTOE_S = 10.0
PROFILES = ("walk", "stand", "run", "tiptoe")


@dataclass(frozen=True, slots=True)
class Gait:
    """A person's gait; what is None follows from the speed, and the speed from the activity.

    ``coverage`` is the share of the load that passes through the units (`simulators.people.shape`).
    """

    body_weight_n: float = BODY_WEIGHT_N
    coverage: float = 1.0
    outside: Outside = "midfoot"
    speed_m_per_s: float | None = None
    cadence_steps_per_min: float | None = None
    stance_share: float | None = None
    stride_time_cv: float | None = None
    load_cv: float | None = None
    load_asymmetry: float = 0.0
    time_asymmetry: float = 0.0
    turning: float = 0.0
    sway_cv: float = 0.03
    first_contact_s: float = 0.5

    @property
    def person(self) -> Person:
        """The person with these options."""
        return Person(self.body_weight_n, self.load_asymmetry, self.time_asymmetry, WALK_RATIO_M_MIN)

    def activity(self, profile: str, duration_s: float) -> Activity | tuple[Part, ...]:
        """The activity of ``profile``, one of `PROFILES`.

        Tiptoe lasts at most 10 s, with flat feet before and after.
        """
        if profile == "stand":
            return Stand(self.sway_cv)
        if profile == "tiptoe":
            flat_s = self.first_contact_s + FLAT_BEFORE_S
            up_s = min(TIPTOE_S, duration_s - flat_s - FLAT_AFTER_S)
            rise = Tiptoe(sway_cv=2.0 * self.sway_cv)
            if up_s < 2.0 * rise.rise_s:
                return Stand(self.sway_cv)
            return ((Stand(self.sway_cv), flat_s), (rise, up_s), (Stand(self.sway_cv), duration_s - flat_s - up_s))
        kind = Run if profile == "run" else Walk
        speed_m_per_s = kind().speed_m_per_s if self.speed_m_per_s is None else self.speed_m_per_s
        return kind(
            speed_m_per_s,
            self.cadence_steps_per_min,
            self.stance_share,
            self.stride_time_cv,
            self.load_cv,
            self.turning,
        )

    def plan(self, profile: str, duration_s: float, rng: np.random.Generator) -> GaitPlan:
        """The plan for ``duration_s``; raises `UsageError` for impossible options."""
        return plan(
            self.person,
            self.activity(profile, duration_s),
            duration_s,
            rng,
            coverage=self.coverage,
            outside=self.outside,
            first_contact_s=self.first_contact_s,
        )
