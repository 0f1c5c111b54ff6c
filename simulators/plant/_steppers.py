"""Connects a bladder's parameters to the compiled time stepping: keeps the memory, and applies load-side effects."""

from __future__ import annotations

import numpy as np

from simulators.effects.contact import ContactState, through_contact
from simulators.effects.outside import fresh, strike
from simulators.plant._kernel_constants import per_newton, plain_constants, wall_constants
from simulators.plant.bladder_parameters import BladderParameters
from simulators.plant.preisach import MEMORY, loop_shape
from smartshoe.arrays import Array


class PlainStepper:
    """Steps the kernel of `simulators.plant._stepping`: the paper's unit and the first effects."""

    def __init__(self, parameters: BladderParameters) -> None:
        self.parameters = p = parameters
        friction = p.hysteresis
        self._shape, loop = loop_shape(friction.half_width_n, friction.spread, p.full_scale_n)
        loop_n = friction.strength * p.full_scale_n / loop if friction.strength else 0.0
        self._constants = plain_constants(p, loop_n)

    @staticmethod
    def suffices(p: BladderParameters) -> bool:
        """Whether the plain kernel implements all effects that are on."""
        many = p.gas_heat.modes > 1 and p.gas_heat.fraction > 0.0
        on = [p.wall_stiffening, p.second_relaxation.k3, p.power_law_creep.stiffness, p.stick_slip.strength]
        on += [p.bouc_wen.strength, p.permanent_set.rate_per_s, p.leak.capillary_per_s, p.leak.nozzle_per_s]
        return not many and not any(on)

    def reset(self, session: int) -> None:
        """Return to rest."""
        from simulators.plant._stepping import STATE_SIZE

        self._state = np.zeros(STATE_SIZE)
        self._turning = np.zeros(MEMORY)
        self._partial = np.zeros(MEMORY)

    def advance(self, load_n: Array, finer: int, step_s: float) -> tuple[Array, Array]:
        """Pressure in units of ambient pressure, and deformation, both (n,)."""
        from simulators.plant._stepping import advance

        pressure, deformation = np.empty(load_n.size), np.empty(load_n.size)
        advance(
            load_n, finer, step_s, self._constants, self._shape,
            self._state, self._turning, self._partial, pressure, deformation,
        )  # fmt: skip
        return pressure, deformation


class WallStepper:
    """Steps the kernel of `simulators.plant._wall_stepping`: every effect of wall and air."""

    def __init__(self, parameters: BladderParameters) -> None:
        self.parameters = p = parameters
        self._front = PlainFront(p)
        self._constants = constants = wall_constants(p)
        creep, creep_rate = p.power_law_creep.arms()
        self._arms = np.concatenate([[p.k2], creep]) * p.x_over_nrt, np.concatenate([[p.k2 / p.c], creep_rate])
        self._heat = p.gas_heat.spread() if p.gas_heat.fraction > 0 else (np.zeros(0), np.zeros(0))
        self._sliders = p.stick_slip.elements(constants.full_stress, constants.full_e)

    def reset(self, session: int) -> None:
        """Return to rest."""
        from simulators.plant._wall_stepping import SCALARS

        self._front.reset()
        self._state = np.zeros(SCALARS)
        self._memory = np.zeros(self._arms[0].size), np.zeros(self._heat[0].size), np.zeros(self._sliders[0].size)
        self._load_n = 0.0

    def advance(self, load_n: Array, finer: int, step_s: float) -> tuple[Array, Array]:
        """Pressure in units of ambient pressure, and deformation, both (n,)."""
        from simulators.plant._wall_stepping import advance_wall

        fine_n = upsampled(load_n, self._load_n, finer)
        stress = self._front.acting(fine_n) * per_newton(self.parameters)
        pressure, deformation = np.empty(fine_n.size), np.empty(fine_n.size)
        advance_wall(
            stress, step_s, self._constants, *self._arms, *self._heat, *self._sliders,
            self._state, *self._memory, pressure, deformation,
        )  # fmt: skip
        self._load_n = float(load_n[-1]) if load_n.size else self._load_n
        return pressure[finer - 1 :: finer], deformation[finer - 1 :: finer]


class PlainFront:
    """The load-side effects of the plain kernel, for the other one: hysteresis, power law, conditioning."""

    def __init__(self, parameters: BladderParameters) -> None:
        self.parameters = p = parameters
        friction = p.hysteresis
        self._shape, loop = loop_shape(friction.half_width_n, friction.spread, p.full_scale_n)
        self._loop_n = friction.strength * p.full_scale_n / loop if friction.strength else 0.0
        self.reset()

    def reset(self) -> None:
        """Return to rest."""
        self._turning, self._partial = np.zeros(MEMORY), np.zeros(MEMORY)
        self._state = np.array([1.0, 0.0, 0.0])

    def acting(self, load_n: Array) -> Array:
        """The load (n,) in N that acts on the wall."""
        p = self.parameters
        acting = load_n
        if self._loop_n != 0.0 or p.conditioning.gain != 0.0:
            from simulators.plant.load_stepping import loop_and_cycles

            loop, cycles = np.empty(load_n.size), np.empty(load_n.size)
            loop_and_cycles(
                load_n, self._shape, p.full_scale_n, self._turning, self._partial, self._state, loop, cycles
            )
            acting = acting + self._loop_n * loop
        if p.static_exponent != 1.0:
            share = np.maximum(acting, 0.0) / p.full_scale_n
            acting = np.where(acting > 0.0, p.full_scale_n * share**p.static_exponent, acting)
        if p.conditioning.gain != 0.0:
            acting = acting * (1.0 - p.conditioning.gain * np.expm1(-cycles / p.conditioning.cycles))
        return np.ascontiguousarray(acting)


class ContactStepper:
    """Applies the contact between plate and tube before either kernel."""

    def __init__(self, parameters: BladderParameters) -> None:
        self.parameters = parameters
        self._tube = _tube(parameters)

    @staticmethod
    def is_needed(p: BladderParameters) -> bool:
        """Whether any effect of the contact is on."""
        contact = (p.contact.saturation, p.contact.gap_n, p.contact.direction_gain, p.contact.rate_gain)
        return any(contact) or any((p.odd.resonance, p.odd.pinch, p.odd.seating, p.odd.snap))

    def reset(self, session: int) -> None:
        """Return to rest; effects outside the catalogue are drawn again for each session."""
        self._tube.reset(session)
        self._contact, self._odd, self._load_n = ContactState(), fresh(session), 0.0

    def advance(self, load_n: Array, finer: int, step_s: float) -> tuple[Array, Array]:
        """Pressure in units of ambient pressure, and deformation, both (n,)."""
        p = self.parameters
        fine_n = upsampled(load_n, self._load_n, finer)
        self._load_n = float(load_n[-1]) if load_n.size else self._load_n
        acting = strike(p.odd, fine_n, 1.0 / step_s, p.full_scale_n, self._odd)
        acting = through_contact(p.contact, acting, 1.0 / step_s, p.full_scale_n, self._contact)
        pressure, deformation = self._tube.advance(np.ascontiguousarray(acting), 1, step_s)
        return pressure[finer - 1 :: finer], deformation[finer - 1 :: finer]


Stepper = PlainStepper | WallStepper | ContactStepper


def _tube(parameters: BladderParameters) -> PlainStepper | WallStepper:
    return PlainStepper(parameters) if PlainStepper.suffices(parameters) else WallStepper(parameters)


def stepper(parameters: BladderParameters) -> Stepper:
    """The time stepping of a unit: the plain kernel alone wherever it implements all effects that are on."""
    return ContactStepper(parameters) if ContactStepper.is_needed(parameters) else _tube(parameters)


def upsampled(load_n: Array, before_n: float, finer: int) -> Array:
    """The load with ``finer`` steps per sample, linear from ``before_n`` on; each sample is the last of its steps."""
    if finer == 1:
        return load_n
    place = np.arange(1, load_n.size * finer + 1) / finer
    return np.asarray(np.interp(place, np.arange(load_n.size + 1), np.concatenate([[before_n], load_n])))
