"""Which law takes a flexible curve's place: costs of fits decide, and how far its shape was stretched."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from told_evidence import WAVE, session_of

from smartshoe.diagnosis import Thresholds, _laws
from smartshoe.models.effects import blocks, catalogue, effect
from smartshoe.models.extended import ExtendedModel

MODEL = ExtendedModel(1.0, 0.08, 0.22, 800.0, 140.0, "mbar")
STANDARD = Thresholds()
USUAL, STRETCHED = 0.3, 0.03  # softness of a dead band, within its bounds and at one
FLEXIBLE_COST, NOTHING_COST = 1000.0, 101_000.0


@pytest.fixture
def costs(monkeypatch: pytest.MonkeyPatch) -> dict[str, tuple[float, float]]:
    """By law what its fit costs, and a shape it ends at; any other law explains nothing."""
    told: dict[str, tuple[float, float]] = {}

    def curved(law: Any, model: ExtendedModel, likelihood: Any, *, other_arm: ExtendedModel) -> Any:
        assert other_arm.names == ()
        cost, shape = told.get(law.name, (NOTHING_COST, USUAL))
        values = law.start()
        for k, parameter in enumerate(law.parameters):
            if parameter.null is None:
                values[k] = shape if law.name == "dead_band" else 0.5 * (parameter.lower + parameter.upper)
        return SimpleNamespace(model=model.with_part(law, values), cost=cost, law=law.name)

    monkeypatch.setattr(_laws, "fit_with", curved)
    monkeypatch.setattr(_laws, "evaluated", lambda likelihood, model: SimpleNamespace(cost=likelihood.cost(model)))
    monkeypatch.setattr(_laws, "fit", lambda likelihood, model, steps: SimpleNamespace(model=model, cost=NOTHING_COST))
    return told


def _law_of(odds: float = 10.0, plain_cost: float = NOTHING_COST) -> tuple[float, str] | None:
    block = next(one for one in blocks()["static_curve"])
    state: Any = SimpleNamespace(
        thresholds=STANDARD,
        fit=SimpleNamespace(model=MODEL.with_part(block)),
        evidence=SimpleNamespace(odds=odds),
    )
    likelihood: Any = SimpleNamespace(cost=lambda model: FLEXIBLE_COST if model.parts else plain_cost, sessions=())
    one: Any = SimpleNamespace(effect=block, name=block.name)
    found = _laws._law_of(one, state, state.fit.model, MODEL, likelihood)
    return None if found is None else (found[0], found[1].law)  # type: ignore[attr-defined]


def _missing(share: float) -> float:
    """Cost of a fit that misses this share of what the flexible curve explains."""
    return FLEXIBLE_COST + share * (NOTHING_COST - FLEXIBLE_COST)


def test_a_law_that_misses_less_than_laws_depart_is_the_law(costs: dict[str, tuple[float, float]]) -> None:
    assert _law_of() is None
    costs["contact_area"] = (_missing(0.9 * STANDARD.law_departure**2), USUAL)
    found = _law_of()
    assert found is not None
    assert found == (pytest.approx(0.9 * STANDARD.law_departure**2, rel=1e-3), "contact_area")
    costs["contact_area"] = (_missing(1.1 * STANDARD.law_departure**2), USUAL)
    assert _law_of() is None


def test_what_a_block_explains_is_no_more_than_the_plain_model_leaves(costs: dict[str, tuple[float, float]]) -> None:
    """A fit about a block is of an arm that nothing bends; without the block another arm may follow far better."""
    costs["contact_area"] = (_missing(0.9 * STANDARD.law_departure**2), USUAL)
    for share, is_law in ((1.0, True), (0.95, True), (0.85, False)):
        assert (_law_of(plain_cost=_missing(share)) is not None) is is_law
    assert _law_of(plain_cost=10.0 * NOTHING_COST) == _law_of()


def test_the_law_that_misses_least_is_taken(costs: dict[str, tuple[float, float]]) -> None:
    costs["contact_area"] = (_missing(0.02), USUAL)
    costs["gas_compression"] = (_missing(0.01), USUAL)
    found = _law_of()
    assert found is not None
    assert found[1] == "gas_compression"


def test_a_law_of_another_family_bears_the_odds_of_another_name(costs: dict[str, tuple[float, float]]) -> None:
    assert effect("dead_band").family != "static_curve"
    costs["dead_band"] = (_missing(0.01), USUAL)
    costs["contact_area"] = (_missing(0.02), USUAL)
    near, far = _law_of(odds=10.0), _law_of(odds=0.05 * (NOTHING_COST - FLEXIBLE_COST))
    assert near is not None
    assert far is not None
    assert (near[1], far[1]) == ("dead_band", "contact_area")


def test_a_shape_at_a_bound_must_miss_less(costs: dict[str, tuple[float, float]]) -> None:
    """Between the squares of the mean departure and of the usual one only a law within its bounds is one."""
    assert STANDARD.departure < STANDARD.law_departure
    between = _missing(0.5 * (STANDARD.departure**2 + STANDARD.law_departure**2))
    for shape, is_law in ((USUAL, True), (STRETCHED, False)):
        costs["dead_band"] = (between, shape)
        assert (_law_of() is not None) is is_law
    costs["dead_band"] = (_missing(0.5 * STANDARD.departure**2), STRETCHED)
    assert _law_of() is not None


def test_only_memoryless_laws_are_tried(costs: dict[str, tuple[float, float]]) -> None:
    for law in catalogue().values():
        if not law.is_memoryless:
            costs[law.name] = (FLEXIBLE_COST, USUAL)
    assert _law_of() is None


def test_a_curve_that_gave_way_to_a_law_does_not_come_back_as_another_curve() -> None:
    flexible = [block for family in blocks().values() for block in family]
    curves = {block.name for block in flexible if block.is_memoryless}
    assert curves
    for block in flexible:
        assert set(_laws._blocks_banned_for(block)) == (curves if block.name in curves else {block.name})


def test_a_law_that_stands_beside_a_block_may_do_without_it(costs: dict[str, tuple[float, float]]) -> None:
    """It is not put in a second time: the model without the block is its fit."""
    block, law = blocks()["gain_drift"][0], effect("gain_drift")
    both = MODEL.with_part(law, law.start()).with_part(block)
    state: Any = SimpleNamespace(
        thresholds=STANDARD, fit=SimpleNamespace(model=both), evidence=SimpleNamespace(odds=10.0)
    )
    likelihood: Any = SimpleNamespace(cost=lambda model: NOTHING_COST - 1.0, sessions=(session_of(WAVE),))
    member: Any = SimpleNamespace(effect=block, name=block.name)
    costs["gain_drift"] = (0.0, USUAL)  # of a second one, were it tried
    assert _laws._law_of(member, state, state.fit.model, MODEL, likelihood) is None
    likelihood.cost = lambda model: NOTHING_COST + 1.0
    found = _laws._law_of(member, state, state.fit.model, MODEL, likelihood)
    assert found is not None
    assert found[1].model.names == ("gain_drift",)
