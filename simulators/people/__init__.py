"""A person in two shoes: walking, running, standing, tiptoe, starts, stops and turns; true loads and true events.

>>> from simulators.people import Person, Walk, trial
>>> made = trial(Person(body_weight_n=700.0), Walk(speed_m_per_s=1.3), duration_s=20.0, sensors=False)
>>> sorted(made.unit_n)[0]
'left_heel'
"""

from simulators.people._plates import Measured, measured
from simulators.people._trial import Trial, blocks, trial
from simulators.people.events import TrueEvent
from simulators.people.person import Person, Run, Stand, Tiptoe, Walk, move_at
from simulators.people.plan import GaitPlan, plan

__all__ = [
    "Measured",
    "Person",
    "GaitPlan",
    "Run",
    "Stand",
    "Tiptoe",
    "Trial",
    "TrueEvent",
    "Walk",
    "blocks",
    "measured",
    "move_at",
    "plan",
    "trial",
]
