"""Laws are what they say: nothing at no amount, apart from their siblings, passive, converging, the same again."""

from __future__ import annotations

import numpy as np
import pytest
from cannot_be_told import PLAIN, leaves
from daily import first_and_bank

from simulators.hidden._baseline import lagged
from simulators.hidden._machine import Chain, Departed, Given, balanced, recorded
from simulators.hidden._protocols import build
from simulators.hidden._scaling import SILENT
from simulators.hidden.cases import case
from simulators.hidden.effects import BY_LAW_ALONE, EFFECTS, Law, Subject, Surroundings, Warp, merged
from simulators.hidden.plans import INSIDE, KINDS, LAWS, MOST_DEPARTURE, plan
from smartshoe.errors import SmartShoeError
from smartshoe.protocol import Protocol, dynamic_protocol

SUBJECT = Subject("left_toe", 1.341, 0.12, 1.0, 143.0, 60.0)
FURTHER = [(effect, law) for effect in (*EFFECTS.values(), *BY_LAW_ALONE.values()) for law in effect.laws]
NAMES = [f"{effect.name}-{law.name}" for effect, law in FURTHER]
SHORT = dynamic_protocol([100.0, 400.0, 800.0], repeats=2, rest_s=2.0)
OPEN_AT_ZERO = 1e-5  # of an effect's typical amount: what is nearly none of it
# A pair of laws of which no amount of the one leaves less than this of the other would be one law.
APART = 0.003


def surroundings(f: np.ndarray, step_s: float) -> Surroundings:
    time_s = np.arange(f.size) * step_s
    return Surroundings(time_s, step_s, f, f, f, float(time_s[-1]), 1, 0.5, np.random.default_rng(3))


def course(step_s: float = 2e-3, slower: float = 1.0) -> np.ndarray:
    """Two unequal cycles with a hold and a minor loop, share of full scale, back to rest, in 24 s."""
    at = np.array([0.0, 1.0, 3.0, 6.0, 7.0, 8.0, 9.0, 12.0, 13.0, 16.0, 17.5, 19.0, 24.0])
    load = np.array([0.0, 0.0, 0.7, 0.7, 0.4, 0.6, 0.0, 0.0, 1.0, 1.0, 0.3, 0.0, 0.0])
    time_s = np.arange(0.0, 24.0 * slower, step_s)
    return np.interp(time_s, slower * at, load)


def draws_of(law: Law, seed: int = 5) -> dict[str, float]:
    return law.draw(np.random.default_rng(seed), SUBJECT)


def changed(law: Law, amount: float, step_s: float = 2e-3, slower: float = 1.0) -> np.ndarray:
    """What the law adds to its signal, or returns where it adds to the chain."""
    f = course(step_s, slower)
    at = surroundings(f, step_s)
    fed = at.time_s if law.place == "shift" else f
    made = law.act(amount, draws_of(law), fed, at)
    return made - f if law.place in ("load", "reading", "log") else made


def test_every_effect_of_the_catalogue_has_three_laws_that_say_what_they_are():
    for name in INSIDE:
        effect = EFFECTS[name]
        assert len(set(effect.law_names)) >= LAWS, name
        assert effect.says, name
    for effect, law in FURTHER:
        assert law.says, (effect.name, law.name)
        assert law.source, (effect.name, law.name)
        assert 0 < law.typical < law.largest


@pytest.mark.parametrize(("effect", "law"), FURTHER, ids=NAMES)
def test_a_law_is_nothing_at_no_amount(effect, law):
    if law.options is not None:
        assert law.options(0.0, draws_of(law), SUBJECT)["neighbour"]["cross_talk"] == 0.0
        return
    none = np.nan_to_num(changed(law, OPEN_AT_ZERO * law.typical), nan=1.0)
    some = np.nan_to_num(changed(law, 0.5 * law.largest), nan=1.0)
    assert np.abs(some).max() > 0
    assert np.abs(none).max() < 0.02 * np.abs(some).max()


@pytest.mark.parametrize(("effect", "law"), FURTHER, ids=NAMES)
def test_a_law_is_the_same_again(effect, law):
    if law.options is None:
        assert np.array_equal(changed(law, law.typical), changed(law, law.typical), equal_nan=True)


SMOOTH = [(e, law) for e, law in FURTHER if law.place in ("load", "stress", "gas", "leak")]


@pytest.mark.parametrize(("effect", "law"), SMOOTH, ids=[f"{e.name}-{law.name}" for e, law in SMOOTH])
def test_a_law_converges_with_the_step(effect, law):
    fine = changed(law, law.typical, 5e-4)[::16]
    size = float(np.sqrt(np.mean(fine**2)))
    coarse, middle = changed(law, law.typical, 8e-3), changed(law, law.typical, 2e-3)[::4]
    off = [float(np.sqrt(np.mean((v[: fine.size] - fine[: v.size]) ** 2))) for v in (coarse, middle)]
    assert off[1] < 0.02 * size
    assert off[1] <= off[0] + 1e-9 * size


PASSIVE = [(e, law) for e, law in FURTHER if e.family in ("relaxation", "hysteresis", "gas_heat")]


@pytest.mark.parametrize(("effect", "law"), PASSIVE, ids=[f"{e.name}-{law.name}" for e, law in PASSIVE])
def test_what_takes_work_takes_it_on_every_closed_path(effect, law):
    f = course()
    held = changed(law, law.typical)
    # Friction on the load is what the wall does not feel: held by the contact.
    stress = -held if law.place == "load" else held
    assert float(np.sum(0.5 * (stress[1:] + stress[:-1]) * np.diff(f))) > 0


@pytest.mark.parametrize("name", ["linear_leak", "orifice_leak"])
def test_air_flows_from_the_higher_pressure(name):
    pressure = np.linspace(-0.3, 1.0, 400)
    for law in EFFECTS[name].laws:
        if law.name == "permeation":  # a membrane gives back what it took up
            continue
        at = surroundings(pressure, 1e-2)
        flow = -np.diff(law.act(law.typical, draws_of(law), pressure, at))
        low, high = pressure[:-1] < -0.15, pressure[1:] > 0.2
        assert (flow[low] <= 0).all()
        assert (flow[high] >= 0).all()


def pressed(protocol: Protocol, options=None, chain: Chain | None = None):
    given = merged(SUBJECT.options(), options or {}, SILENT)
    return recorded(given, [protocol], 3, chain or Chain(), SUBJECT)


# Noise, faults and offsets have no plain equation; a departure of them means nothing.
COMPARED = [(e, law) for e, law in FURTHER if e.name in PLAIN]
# On this protocol; the rest of the 0.4 is the drawn warp's.
MOST_OF_A_LAW = 0.5


@pytest.mark.parametrize(("effect", "law"), COMPARED, ids=[f"{e.name}-{law.name}" for e, law in COMPARED])
def test_a_law_departs_from_the_plain_equation_of_its_effect(effect, law):
    shown = {"hysteresis": "minor_loops", "asymmetry": "minor_loops", "relaxation": "holds", "gas_heat": "holds"}
    protocol = build(shown.get(effect.family, "shuffled"), np.random.default_rng(2))
    draws = draws_of(law)
    options = law.options(law.typical, draws, SUBJECT) if law.options else {}
    chain = Chain() if law.options else Chain((Given(law, law.typical, draws),))
    size, left = leaves(pressed(protocol, options, chain), SUBJECT.full_scale_mbar, [effect.name])
    assert size > 0.02  # percent of full scale: there is something to compare
    assert 0.003 < left[effect.name] / size < MOST_OF_A_LAW


@pytest.mark.parametrize("name", [name for name in INSIDE if len([w for w in EFFECTS[name].laws if not w.options]) > 1])
def test_sibling_laws_are_not_one_law(name):
    step_s = 2e-2  # four minutes: what drifts is seen
    one, other = (changed(law, law.typical, step_s, 10.0) for law in EFFECTS[name].laws)
    if EFFECTS[name].laws[0].bends is None:  # drawn, or one constant and more: they differ by the draw
        assert not np.array_equal(one, other, equal_nan=True)
        return
    f = course(step_s, 10.0)
    beside = np.column_stack([f, lagged(f, step_s, 0.3), np.ones(f.size)]) if EFFECTS[name].stage != "logger" else None
    columns = other[:, None] if beside is None else np.column_stack([beside, other])
    own = one if beside is None else one - beside @ np.linalg.lstsq(beside, one, rcond=None)[0]
    rest = one - columns @ np.linalg.lstsq(columns, one, rcond=None)[0]
    assert np.linalg.norm(rest) > APART * np.linalg.norm(own)


def test_a_balance_holds_what_it_says():
    law = EFFECTS["wall_hardening"].named("gibson_ashby")
    assert law is not None
    f = course()
    at = surroundings(f, 2e-3)
    one = Given(law, 0.05, draws_of(law))
    u, further = balanced([one], f, at, SUBJECT)
    assert np.abs(further).max() == 0.0
    # Under a load held without end the wall takes what its deformation asks for.
    stiff = SUBJECT.k1 * 0.38113
    at_once = (1 + stiff) / (1 + stiff + SUBJECT.k2 * 0.38113)
    x = at_once * u + (1 - at_once) * lagged(u, 2e-3, at_once * SUBJECT.k2)
    assert f - u == pytest.approx(one.acts(x, at), abs=1e-4)


def test_a_balance_that_does_not_settle_is_refused():
    law = EFFECTS["wall_hardening"].named("arruda_boyce")
    assert law is not None
    f = course()
    with pytest.raises(SmartShoeError, match="arruda_boyce"):
        balanced([Given(law, 60.0, draws_of(law))], f, surroundings(f, 2e-3), SUBJECT)


def test_a_departure_bends_and_no_departure_changes_nothing():
    warp = Warp.drawn(np.random.default_rng(4))
    x = np.linspace(0.0, 1.0, 300)
    assert (np.diff(warp.of(x)) > 0).all()
    assert warp.of(np.array([0.0, 1.0])) == pytest.approx([0.0, 1.0])
    assert np.array_equal(Warp(0.0, warp.weights).of(x), x)
    options = EFFECTS["contact_area"].options(0.1, {}, SUBJECT)
    straight = pressed(SHORT, options)[0].pressure_pa
    as_departed = Chain((), (Departed(options, "load", Warp()),))
    none = pressed(SHORT, {}, as_departed)[0].pressure_pa
    bent = pressed(SHORT, {}, Chain((), (Departed(options, "load", warp),)))[0].pressure_pa
    # A departure of nothing is the effect itself; 24 bits of the converter.
    assert none == pytest.approx(straight, abs=2e-4 * straight.max())
    assert np.abs(bent - straight).max() > 1e-3 * straight.max()


@pytest.mark.parametrize("kind", KINDS)
def test_the_bank_plans_the_same_for_ever_and_within_its_bounds(kind):
    plans = [plan(kind, index) for index in range(70)]
    assert plans == [plan(kind, index) for index in range(70)]
    for p in plans:
        assert all(0.05 <= percent <= 5.0 for percent in p.asked_percent)
        assert all(0.0 <= departure <= MOST_DEPARTURE for departure in p.departures)
        assert 49.0 <= p.sample_rate_hz <= 1000.0
        assert abs(p.tare_n) <= 24.0
        assert abs(p.offset_share) <= 0.015
        assert abs(p.late_s) <= 0.02
    if kind == "single":
        assert {p.effects[0] for p in plans[:35]} == set(INSIDE)
    assert len({p.zero for p in plans}) == 3
    if kind in ("none", "single"):
        assert any(set(p.fitted) == {"single_rate"} for p in plans)


@pytest.mark.parametrize("index", first_and_bank([816, 900], {816}))
def test_a_departure_stays_within_its_bound_at_the_amount_that_was_found(index):
    """A second arm near the unit's own is mostly absorbed: forty times the usual amount is found, which bends more."""
    for one in case("two", index).hidden:
        assert one.departure is not None
        assert 0.0 < one.departure <= MOST_DEPARTURE, one.effect.name


def test_three_worlds_share_everything_but_the_law():
    one, other = plan("worlds", 9), plan("worlds", 10)
    assert one.laws != other.laws
    differ = {field for field in one.__dataclass_fields__ if getattr(one, field) != getattr(other, field)}
    assert differ == {"index", "laws", "law_seed"}


def test_a_case_is_the_same_again_and_its_truth_says_what_is_in_it():
    found = [case("worlds", 10), case("worlds", 10)]
    for one, other in zip(*(c.recordings + c.hold_out for c in found), strict=True):
        assert np.array_equal(one.pressure_pa, other.pressure_pa)
        assert np.array_equal(one.force_n, other.force_n)
    truth = found[0].truth
    assert truth == found[1].truth
    (effect,) = truth["effects"]
    assert effect["strength_percent"] == pytest.approx(effect["asked_percent"], rel=0.05)
    assert effect["law"] == found[0].plan.laws[0]


def test_a_unit_that_is_never_unloaded_starts_and_stays_under_its_load():
    index = next(
        k for k in range(40) if plan("none", k).zero == "never_unloaded" and plan("none", k).sample_rate_hz <= 100
    )
    made = case("none", index)
    for recording in made.recordings:
        assert recording.time_s[0] == 0.0
        load = recording.force_n - made.plan.tare_n
        assert load.min() > made.plan.floor_n - 5.0  # of the load cell's noise
        assert load[:3].mean() == pytest.approx(made.plan.floor_n, abs=3.0)  # some protocols ramp at once
