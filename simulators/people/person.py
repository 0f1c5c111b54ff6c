"""A person and the activities of a trial; properties that are not given follow from the speed.

Speeds are in m/s over the ground or the belt. Sources of the laws: `simulators.people._speed`.
"""

from __future__ import annotations

from dataclasses import dataclass

from simulators.people import _speed as speed
from smartshoe.errors import UsageError

BODY_WEIGHT_N = 519.4  # 53 kg, Chinimilli 2016, Section VI
LARGEST_ASYMMETRY = 0.5


def _require(holds: bool, says: str) -> None:
    if not holds:
        raise UsageError(says)


@dataclass(frozen=True, slots=True)
class Person:
    """A person. Asymmetries are (right - left)/mean, of a foot's vertical impulse and of its stance time."""

    body_weight_n: float = BODY_WEIGHT_N
    load_asymmetry: float = 0.0
    time_asymmetry: float = 0.0
    walk_ratio_m_min: float = speed.WALK_RATIO_M_MIN

    def __post_init__(self) -> None:
        _require(self.body_weight_n > 0, f"body_weight_n is {self.body_weight_n:g}: give a weight above 0 N")
        for name in ("load_asymmetry", "time_asymmetry"):
            value = getattr(self, name)
            _require(
                abs(value) <= LARGEST_ASYMMETRY,
                f"{name} is {value:g}: give a number from -{LARGEST_ASYMMETRY:g} to {LARGEST_ASYMMETRY:g}",
            )


@dataclass(frozen=True, slots=True)
class Move:
    """Walking or running at a speed; properties that are None follow from the speed.

    ``stride_time_cv`` is the stride time's standard deviation over its mean, ``load_cv`` that of each region's load
    from stance to stance. ``turning`` is 0 straight on, towards 1 a tight turn to the left, towards -1 to the right.
    """

    speed_m_per_s: float
    cadence_steps_per_min: float | None = None
    stance_share: float | None = None
    stride_time_cv: float | None = None
    load_cv: float | None = None
    turning: float = 0.0

    def __post_init__(self) -> None:
        low, high = self.speeds_m_per_s
        _require(
            low <= self.speed_m_per_s <= high,
            f"{type(self).__name__.lower()} at {self.speed_m_per_s:g} m/s: give a speed from {low:g} to {high:g} m/s",
        )
        _require(abs(self.turning) <= 1, f"turning is {self.turning:g}: give a number from -1 to 1")
        share = self.resolved_stance_share
        least, most = self.stance_shares
        _require(least <= share <= most, f"stance_share is {share:g}: give a number from {least:g} to {most:g}")

    @property
    def speeds_m_per_s(self) -> tuple[float, float]:
        """The range of speeds in m/s at which a person can move like this."""
        raise NotImplementedError

    @property
    def stance_shares(self) -> tuple[float, float]:
        """The range of the share of a stride that a stance lasts: above a half is walking."""
        raise NotImplementedError

    def cadence(self, person: Person) -> float:
        """Steps per minute, both feet."""
        raise NotImplementedError

    @property
    def resolved_stance_share(self) -> float:
        """Stance over stride time."""
        raise NotImplementedError

    @property
    def resolved_stride_time_cv(self) -> float:
        """Standard deviation over mean of the stride time."""
        return self.stride_time_cv if self.stride_time_cv is not None else speed.stride_time_cv(self.speed_m_per_s)

    @property
    def resolved_load_cv(self) -> float:
        """Standard deviation over mean of a region's load, stance to stance."""
        return self.load_cv if self.load_cv is not None else speed.load_cv(self.speed_m_per_s)


@dataclass(frozen=True, slots=True)
class Walk(Move):
    """Walking: a foot is on the ground for more than half of its stride."""

    speed_m_per_s: float = 1.3

    @property
    def speeds_m_per_s(self) -> tuple[float, float]:
        """From a shuffle to a speed that only race walkers exceed."""
        return 0.3, 2.6

    @property
    def stance_shares(self) -> tuple[float, float]:
        """Above a half, so that both feet are on the ground twice per stride."""
        return 0.505, 0.85

    def cadence(self, person: Person) -> float:
        """Steps per minute, from the walk ratio where it is not given."""
        given = self.cadence_steps_per_min
        return given if given is not None else speed.walking_cadence(self.speed_m_per_s, person.walk_ratio_m_min)

    @property
    def resolved_stance_share(self) -> float:
        """Stance over stride time."""
        return self.stance_share if self.stance_share is not None else speed.walking_stance_share(self.speed_m_per_s)


@dataclass(frozen=True, slots=True)
class Run(Move):
    """Running: between two stances nothing touches the ground."""

    speed_m_per_s: float = 2.68  # 6 mph, Chinimilli 2016, Section VI

    @property
    def speeds_m_per_s(self) -> tuple[float, float]:
        """From the slowest jog to a sprint."""
        return 1.6, 8.0

    @property
    def stance_shares(self) -> tuple[float, float]:
        """Below a half, so that there is a flight after each stance."""
        return 0.15, 0.495

    def cadence(self, person: Person) -> float:
        """Steps per minute."""
        given = self.cadence_steps_per_min
        return given if given is not None else speed.running_cadence(self.speed_m_per_s)

    @property
    def resolved_stance_share(self) -> float:
        """Stance over stride time."""
        return self.stance_share if self.stance_share is not None else speed.running_stance_share(self.speed_m_per_s)


def move_at(speed_m_per_s: float) -> Walk | Run:
    """Walking or running, as a person does at this speed of a belt; the transition is at 2.05 m/s."""
    return Walk(speed_m_per_s) if speed_m_per_s < speed.TRANSITION_M_PER_S else Run(speed_m_per_s)


@dataclass(frozen=True, slots=True)
class Stand:
    """Standing on both feet: ``sway_cv`` is the sway of load between heel and forefoot, rms over the heel's load."""

    sway_cv: float = 0.03


@dataclass(frozen=True, slots=True)
class Tiptoe:
    """From flat feet onto the toes and back, in ``rise_s`` each way; on the toes for the rest of its duration."""

    rise_s: float = 0.8
    sway_cv: float = 0.06

    def __post_init__(self) -> None:
        _require(self.rise_s >= 0.3, f"rise_s is {self.rise_s:g}: nobody rises in less than 0.3 s without a jump")


Activity = Walk | Run | Stand | Tiptoe
Part = tuple[Activity, float]  # an activity and its duration in s
