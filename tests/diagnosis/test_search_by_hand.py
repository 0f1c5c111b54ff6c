"""Which effects are found, by evidence that is told beforehand: additions, steps, states, members, folds."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from told_evidence import STANDARD, WAVE, ToldEvidence, candidate, session_of, worth

from smartshoe.diagnosis import _members, _search, _state, _validation
from smartshoe.diagnosis._evidence import Posterior
from smartshoe.diagnosis._members import (
    Alternative,
    _confounded_law,
    _other_laws,
    _shapes_beside,
    alternatives,
    fit_with,
    members_of,
    start_with,
)
from smartshoe.diagnosis._own_terms import residual_of
from smartshoe.diagnosis._search import best_additions, best_step, is_admissible, search
from smartshoe.diagnosis._validation import (
    LeftOut,
    _in_standard_errors,
    error_of,
    extrapolating_effect,
    folds_of,
    rms_difference,
    thirds_of,
)
from smartshoe.models.effects import effect
from smartshoe.models.extended import ExtendedModel

Array = NDArray[np.float64]

MODEL = ExtendedModel(1.0, 0.08, 0.22, 800.0, 140.0, "mbar")


# -- additions and steps ----------------------------------------------------------------------------------------------
def test_members_far_larger_than_all_together_cancel() -> None:
    evidence: Any = ToldEvidence([candidate("a"), candidate("b")], worth(1.0, 1.0))
    found = evidence.posterior((0, 1))
    for together, is_allowed in ((2.5, True), (2.499, False)):
        assert is_admissible(evidence, replace(found, sizes=(3.0, 4.0), together=together)) is is_allowed


def test_a_new_member_of_one_strength_has_its_sign() -> None:
    def told(inside: tuple[str, ...], strengths: Array) -> bool:
        evidence: Any = ToldEvidence([candidate("a"), candidate("b", sign=-1.0)], worth(1.0, 1.0), inside)
        evidence.strengths[1] = strengths
        return is_admissible(evidence, evidence.posterior((0, 1)))

    assert told((), np.array([-1.0]))
    assert not told((), np.array([1.0]))
    assert told(("b",), np.array([1.0]))  # within a fit its bounds hold it
    assert not told(("a",), np.array([1.0]))
    assert told((), np.array([1.0, 1.0]))


def test_additions_are_the_best_shape_of_each_effect_in_order() -> None:
    candidates = [candidate("a"), candidate("a"), candidate("b", "of b"), candidate("c", "of b"),
                  candidate("d", sign=-1.0), candidate("e")]  # fmt: skip
    evidence: Any = ToldEvidence(candidates, worth(1.0, 5.0, 3.0, 4.0, 9.0, 2.0))
    assert best_additions(evidence, (), 10) == [1, 3, 2, 5]
    assert best_additions(evidence, (), 2) == [1, 3]
    assert best_additions(evidence, (2,), 10) == [1, 5]
    assert best_additions(evidence, (), 10, ("a",)) == [3, 2, 5]
    evidence.strengths[4] = np.ones(2)
    assert best_additions(evidence, (), 1) == [4]
    inside: Any = ToldEvidence(candidates, worth(1.0, 5.0, 3.0, 4.0, 9.0, 2.0), ("d",))
    assert best_additions(inside, (), 1) == [4]
    first: Any = ToldEvidence([candidate("a"), candidate("a")], worth(5.0, 5.0))
    assert best_additions(first, (), 5) == [0]
    assert len(best_additions(ToldEvidence([candidate(f"n{k}") for k in range(9)], worth(*range(9))), ())) == 5  # type: ignore[arg-type]


def test_a_step_adds_drops_or_swaps_for_the_better() -> None:
    candidates = [candidate(f"n{k}") for k in range(9)]
    added: Any = ToldEvidence(candidates, worth(1.0, 7.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    assert best_step(added, (0,)).members == (0, 1)
    dropped: Any = ToldEvidence(candidates, worth(*[-1.0] * 9))
    assert best_step(dropped, (0, 1)).members in ((0,), (1,))
    assert best_step(dropped, ()).members == ()
    # Two that are worth nothing beside each other, each better than the first.
    table = {(0,): 90.0, (1,): 50.0, (2,): 60.0}
    swapped: Any = ToldEvidence(candidates[:3], lambda members: table.get(members, 100.0))
    assert best_step(swapped, (0,)).members == (1,)
    assert best_step(swapped, (0,), ("n1",)).members == (2,)
    # No more than seven; of eight one may go.
    full: Any = ToldEvidence(candidates, worth(*[1.0] * 9))
    assert len(best_step(full, tuple(range(6))).members) == 7
    assert len(best_step(full, tuple(range(7))).members) == 7
    # A set that is not allowed is none.
    wrong: Any = ToldEvidence([candidate("a", sign=-1.0), candidate("b")], worth(9.0, -3.0))
    wrong.strengths[0] = np.ones(1)
    assert best_step(wrong, (1,)).members == ()


@pytest.mark.parametrize(("barred", "members"), [(5, (0,)), (4, (0, 5))])
def test_five_are_tried_beside_a_set(monkeypatch: pytest.MonkeyPatch, barred: int, members: tuple[int, ...]) -> None:
    """The best ones barred: those that come after them are not looked at."""
    candidates = [candidate(f"n{k}") for k in range(12)]
    beside: Any = ToldEvidence(candidates, worth(*(50.0 - k for k in range(12))))
    bad = set(range(1, 1 + barred))
    monkeypatch.setattr(_search, "is_admissible", lambda evidence, found: not bad & set(found.members))
    assert best_step(beside, (0,)).members == members


@pytest.mark.parametrize(("barred", "members"), [(3, (0,)), (2, (3,))])
def test_three_are_tried_in_each_members_place(
    monkeypatch: pytest.MonkeyPatch, barred: int, members: tuple[int, ...]
) -> None:
    alone = {(k,): 50.0 + k for k in range(1, 9)}
    evidence: Any = ToldEvidence([candidate(f"n{k}") for k in range(9)], lambda given: alone.get(given, 100.0))
    monkeypatch.setattr(
        _search, "is_admissible", lambda evidence, found: not set(range(1, 1 + barred)) & set(found.members)
    )
    assert best_step(evidence, (0,)).members == members


def test_a_search_goes_on_while_it_gains() -> None:
    evidence: Any = ToldEvidence([candidate(f"n{k}") for k in range(4)], worth(5.0, 3e-6, 0.5e-6, -1.0))
    assert search(evidence).members == (0, 1)
    assert search(evidence, (2, 3)).members[0] == 0
    assert search(evidence, (), ("n0",)).members == (1,)


# -- states -----------------------------------------------------------------------------------------------------------
def test_what_is_so_large_that_it_bends_is_taken_by_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    """More than a hundredth, of what is not in the model already."""
    given: Any = SimpleNamespace(candidates=[candidate("a"), candidate("b")], noise_sd=lambda: 0.5)
    told: list[Any] = []
    monkeypatch.setattr(_state, "linearised", lambda *args: given)
    monkeypatch.setattr(_state, "Evidence", lambda made, noise_sd: ("evidence", noise_sd) if made is given else None)
    monkeypatch.setattr(_state, "search", lambda evidence, members, banned: told.append((members, banned)) or "all")
    model: Any = SimpleNamespace(names=("a",))
    for size, answer in ((0.01, "all"), (0.0101, "first")):
        first = Posterior((0, 1), 0.0, (), (0.5, size), ())
        seen: list[Any] = []

        def stepped(evidence: Any, start: Any, banned: Any, first: Any = first, seen: list[Any] = seen) -> Posterior:
            seen.append((evidence, start, banned))
            return first

        monkeypatch.setattr(_state, "best_step", stepped)
        found = _state.linearised_search(model, [], STANDARD, ("z",))
        assert found == (("evidence", 0.5), first if answer == "first" else "all")
        assert seen == [(("evidence", 0.5), (0,), ("z",))]
    assert told == [((0, 1), ("z",))]


def test_new_effects_begin_on_the_best_part_of_the_way() -> None:
    """Of the whole way, a half, a fifth and a twentieth; those that were not found go, those that are there stay."""
    one, two = effect("sensor_nonlinearity"), effect("delay")
    candidates = [
        SimpleNamespace(name=one.name, effect=one, columns=(1, 2, 3), start=lambda s: np.array(s, dtype=float)),
        SimpleNamespace(name=two.name, effect=two, columns=(4,), start=lambda s: np.array(s, dtype=float)),
    ]
    given: Any = SimpleNamespace(candidates=candidates, scales=np.array([1.0, 2.0, 4.0, 5.0, 10.0]))
    found = Posterior((0, 1), 0.0, (np.array([0.2, 0.4, 0.5]), np.array([3.0])), (), ())
    model = MODEL.with_part(two, np.array([0.07])).with_part("dead_band", np.array([0.05, 0.2, 0.0]))
    for length in (1.0, 0.5, 0.2, 0.05):
        likelihood: Any = SimpleNamespace(cost=lambda trial, length=length: abs(float(trial.theta[-3]) - length * 0.1))
        begun = _state.with_members(given, found, model, likelihood)
        assert begun.names == ("delay", "sensor_nonlinearity")
        assert begun.theta[3:] == pytest.approx([0.07, 0.1 * length, 0.1 * length, 0.1 * length])
    kept = _state.with_members(given, replace(found, members=(1,), strengths=found.strengths[1:]), model, likelihood)
    assert kept.names == ("delay",)


# -- members ----------------------------------------------------------------------------------------------------------
def test_members_are_weighed_against_what_could_stand_in_their_place(monkeypatch: pytest.MonkeyPatch) -> None:
    candidates = [candidate("a", "x"), candidate("b"), candidate("a", "x"), candidate("c", is_flexible=True),
                  candidate("d"), candidate("e", sign=-1.0)]  # fmt: skip
    evidence: Any = ToldEvidence(candidates, worth(50.0, 20.0, 49.0, 30.0, 10.0, 40.0))
    best = evidence.posterior((0, 1))
    near = alternatives(evidence, best, 0)
    # Nothing, and d in its place; not itself at another shape, no flexible block, none that cancels or has no sign.
    assert [(one.effect, one.margin) for one in near] == [("d", 40.0), (None, 50.0)]
    # What the others' families could do instead is no evidence for it.
    evidence.of_any_law = worth(3.0, 45.0, 0.0, 0.0, 0.0, 0.0)
    assert [(one.effect, one.margin) for one in alternatives(evidence, best, 0)] == [(None, 3.0), ("d", 40.0)]
    # Nor is it needed where they need it only if they may.
    evidence.of_any_law = worth(90.0, 45.0, 0.0, 0.0, 0.0, 0.0)
    assert [(one.effect, one.margin) for one in alternatives(evidence, best, 0)] == [("d", 40.0), (None, 50.0)]
    # Nor what they could do by departing in all that they add.
    evidence.of_whole_effects = ToldEvidence(candidates, worth(7.0, 20.0, 0.0, 0.0, 0.0, 0.0))
    assert [(one.effect, one.margin) for one in alternatives(evidence, best, 0)] == [(None, 7.0), ("d", 40.0)]


def test_ten_are_weighed_against_a_member() -> None:
    evidence: Any = ToldEvidence([candidate(f"n{k}") for k in range(14)], worth(*(20.0 - k for k in range(14))))
    near = alternatives(evidence, evidence.posterior((13,)), 13)
    assert [one.effect for one in near] == [f"n{k}" for k in range(10)] + [None]


def test_a_member_is_as_large_as_the_reading_moves_without_it(monkeypatch: pytest.MonkeyPatch) -> None:
    one, two = effect("linear_leak"), effect("dead_band")
    candidates = [SimpleNamespace(name=e.name, effect=e, columns=(k,), slot=e.family) for k, e in enumerate((one, two))]
    evidence: Any = SimpleNamespace(
        linearisation=SimpleNamespace(candidates=candidates), thresholds=STANDARD, extensions=lambda members: []
    )
    sizes = {"linear_leak": 0.999 * STANDARD.material, "dead_band": 2.0 * STANDARD.material}
    costs = {(): 500.0, ("dead_band",): 130.0, ("linear_leak",): 170.0}
    asked: list[Any] = []

    def fitted(likelihood: Any, model: ExtendedModel, steps: int = 99) -> Any:
        asked.append(steps)
        cost = costs.get(model.names, 103.0 + len(model.names[-1]))
        return SimpleNamespace(model=model, cost=cost, likelihood=likelihood)

    monkeypatch.setattr(_members, "fit", fitted)
    ways = {"linear_leak": np.ones(2), "dead_band": np.array([math.sqrt(2.0), 0.0])}  # 45 degrees apart

    def left(likelihood: Any, found: Any) -> Array:
        missing = [name for name in sizes if name not in found.model.names]
        return np.array([3.0, 7.0]) + sum((sizes[name] * ways[name] for name in missing), np.zeros(2))

    monkeypatch.setattr(_members, "_residuals", left)
    near = [Alternative(name, 1.0) for name in ("orifice_leak", "zero_drift", "delay", "contact_area")]
    monkeypatch.setattr(_members, "alternatives", lambda *given: (Alternative(None, float(given[2])), *near))
    monkeypatch.setattr(
        _members,
        "fit_with",
        lambda law, model, likelihood, *_: fitted(likelihood, model.with_part(law, law.begun()), 4),
    )
    present = frozenset({"low_loads"})
    monkeypatch.setattr(_members, "excitation_of", lambda *given: SimpleNamespace(tells_apart=present))
    laws = [effect(name) for name in ("orifice_leak", "dead_band", "delay")]
    monkeypatch.setattr(_members, "available_effects", lambda sessions, thresholds: laws)
    likelihood: Any = SimpleNamespace(sessions=(), thresholds=STANDARD)
    extended: Any = SimpleNamespace(model=MODEL.with_part(one).with_part(two), cost=100.0, likelihood=likelihood)
    best = Posterior((0, 1), 0.0, (), (), (0.3, 0.7))
    found = members_of(evidence, best, extended)
    assert [(m.name, m.departure_sds, m.likelihood_ratio) for m in found] == [
        ("dead_band", 0.7, 70.0),
        ("linear_leak", 0.3, 30.0),
    ]
    assert [m.size for m in found] == pytest.approx([sizes["dead_band"], sizes["linear_leak"]])
    assert [m.likeness for m in found] == pytest.approx([math.sqrt(0.5)] * 2)
    assert [m.others_departure_rms for m in found] == pytest.approx(
        [0.25 * 0.3 * sizes["linear_leak"], 0.25 * 0.7 * sizes["dead_band"]]
    )
    assert [[one.margin for one in m.alternatives] for m in found] == [
        [1.0, 1.0, 1.0, 1.0, 1.0],
        [0.0, 1.0, 1.0, 1.0, 1.0],
    ]
    assert (found[1].laws, found[1].confounded) == ((), ())  # what is hardly there has no other law
    assert found[0].confounded == ()  # low loads tell a dead band from a curve, and nothing must tell it from a delay
    others = [law.name for law in laws if law.family == two.family and law.name != two.name]
    assert [law.effect for law in found[0].laws] == others
    assert set(asked) == {4}
    sizes["linear_leak"] *= 3.0
    ways["linear_leak"] *= -1.0
    (leak, _) = members_of(evidence, best, extended)
    assert [(law.effect, law.margin) for law in leak.laws] == [("orifice_leak", 15.0)]
    assert leak.likeness == 0.0  # the other pulls against it
    # Of another kind, and told from it by what is not there; the free form of another branch is none of its kind.
    assert [(law.effect, law.margin) for law in leak.confounded] == [("zero_drift", 13.0)]
    assert 99 in asked  # fitted to its end, others a few steps
    assert _confounded_law(Alternative("gas_compression", 1.0), two, frozenset()) is None  # two curves
    assert _confounded_law(Alternative("zero_drift", 1.0), one, frozenset()) is effect("zero_drift")


def test_a_law_begins_at_the_likeliest_of_its_shapes() -> None:
    law = effect("second_relaxation")
    wanted = law.begun(law.shapes[-1])
    likelihood: Any = SimpleNamespace(
        cost=lambda model: float(np.sum(np.abs(model.parts[-1].values - wanted))), sessions=[]
    )
    assert list(start_with(law, MODEL, likelihood).parts[-1].values) == list(wanted)


def test_a_law_is_fitted_from_all_its_shapes_small_and_large(monkeypatch: pytest.MonkeyPatch) -> None:
    law = effect("second_relaxation")
    begun: list[Any] = []

    def fitted(likelihood: Any, model: ExtendedModel, steps: int, rows: Any = None) -> Any:
        begun.append((tuple(model.parts[-1].values), steps))
        return SimpleNamespace(model=model, cost=-len(begun))

    monkeypatch.setattr(_members, "fit", fitted)
    unlogged: Any = SimpleNamespace(sessions=[])
    found: Any = fit_with(law, MODEL, unlogged)
    starts = [tuple(law.begun(shape, sizes)) for shape in law.shapes for sizes in (0.5, 5.0, 20.0)]
    assert begun[:-1] == [(start, 1) for start in starts]
    assert begun[-1] == (starts[-1], 4)  # the best of them goes on
    assert found.model.parts[-1].effect is law
    begun.clear()
    few = law.shapes[1:3]
    fit_with(law, MODEL, unlogged, few)
    assert [start for start, _ in begun[:-1]] == [tuple(law.begun(one, sizes)) for one in few for sizes in (0.5, 5, 20)]
    # Beside an arm that is clearly another one each begins once more.
    limited: Any = SimpleNamespace(sessions=[], thresholds=STANDARD)
    for times, count in ((1.9, 1), (1.0 / 1.9, 1), (2.1, 2), (1.0 / 2.1, 2)):
        begun.clear()
        fit_with(law, MODEL, limited, few, replace(MODEL, relaxation_rate_per_s=times * MODEL.relaxation_rate_per_s))
        assert len(begun) == 1 + count * 3 * len(few)


def test_in_a_members_place_a_law_is_tried_at_its_likeliest_shapes(monkeypatch: pytest.MonkeyPatch) -> None:
    law = effect("second_relaxation")
    shapes = [{"time_constant": at} for at in (1.0, 2.0, 3.0)]
    of_creep = [SimpleNamespace(name=law.name, shape=shape) for shape in shapes]
    others = [SimpleNamespace(name="power_law_creep", shape={}), SimpleNamespace(name="delay", shape={})]
    scores = {0: 5.0, 1: 7.0, 2: 3.0, 4: 1.0}
    asked: list[Any] = []

    def extensions(members: Any) -> Any:
        asked.append(members)
        return [(score, k, np.ones(1)) for k, score in scores.items()]

    evidence: Any = SimpleNamespace(
        linearisation=SimpleNamespace(candidates=[*of_creep, *others]), extensions=extensions
    )
    found = _shapes_beside(Posterior((3, 4), 0.0, (), (), (0.3, 0.7)), 3, evidence)
    assert found == {law.name: [shapes[2], shapes[0], shapes[1]], "delay": [{}]}
    assert asked == [(4,)]
    tried: list[Any] = []

    def fitted(law: Any, model: Any, likelihood: Any, shapes: Any, beside: Any) -> Any:
        tried.append((law.name, list(shapes)))
        assert beside.names == ()
        return SimpleNamespace(cost=110.0, model=model.with_part(law, ends.pop()))

    ends = [[0.0, 20.0], [0.1, 120.0], [0.1, 119.0]]
    monkeypatch.setattr(_members, "fit_with", fitted)
    monkeypatch.setattr(_members, "fit", lambda likelihood, model, steps: SimpleNamespace(cost=104.0, model=model))
    monkeypatch.setattr(_members, "available_effects", lambda sessions, thresholds: [law])
    less: Any = SimpleNamespace(model=MODEL, likelihood=SimpleNamespace(sessions=(), thresholds=STANDARD))
    one: Any = SimpleNamespace(name="power_law_creep", effect=effect("power_law_creep"))
    extended: Any = SimpleNamespace(cost=100.0, model=MODEL.with_part("power_law_creep"))
    (other,) = _other_laws(one, less, extended, found, is_at_end_of_kind=False)
    assert (other.effect, other.margin) == (law.name, 10.0)
    assert tried == [(law.name, [shapes[2], shapes[0]])]
    (freed,) = _other_laws(one, less, extended, found, is_at_end_of_kind=False)
    assert (freed.effect, freed.margin) == (law.name, 4.0)  # freed of the bound it ended at
    # Of a law that ends at nothing the others in the fit follow all.
    assert _other_laws(one, less, extended, found, is_at_end_of_kind=False) == ()


@pytest.mark.parametrize("goes_on", [True, False])
def test_a_law_that_goes_on_to_an_arm_as_no_wall_has_is_weighed_beside_the_arm_that_was_found(
    monkeypatch: pytest.MonkeyPatch, goes_on: bool
) -> None:
    """It follows by the arm what it does not follow itself; but what the block follows it may follow all the same."""
    law, values = effect("sensor_lag"), np.array([0.03, 0.1])
    bent = replace(MODEL, relaxation_rate_per_s=0.02).with_part(law, values)
    fits: list[Any] = []

    def refitted(likelihood: Any, model: Any, steps: Any = None, only_effect: Any = None) -> Any:
        fits.append((model, only_effect))
        end = replace(model, relaxing_share=9.0) if only_effect is None and goes_on else model
        return SimpleNamespace(cost=130.0 if only_effect else 40.0, model=end)

    monkeypatch.setattr(_members, "fit_with", lambda *_: SimpleNamespace(cost=50.0, model=bent))
    monkeypatch.setattr(_members, "available_effects", lambda sessions, thresholds: [law])
    monkeypatch.setattr(_members, "fit", refitted)
    kept = MODEL.with_part("gain_drift")
    less: Any = SimpleNamespace(model=kept, likelihood=SimpleNamespace(sessions=(), thresholds=STANDARD))
    extended: Any = SimpleNamespace(cost=100.0, model=kept.with_part("delay", np.array([0.02])))
    one: Any = SimpleNamespace(name="delay", effect=effect("delay"))
    (other,) = _other_laws(one, less, extended, {}, is_at_end_of_kind=False)
    if not goes_on:
        assert (other.margin, len(fits)) == (-50.0, 1)
        return
    (_, (model, only)) = fits
    assert (other.margin, only) == (30.0, law.name)
    assert model.names == ("gain_drift", "sensor_lag")
    assert (model.relaxing_share, model.relaxation_rate_per_s) == (MODEL.relaxing_share, MODEL.relaxation_rate_per_s)
    assert model.part("sensor_lag").values == pytest.approx(values)


# -- folds ------------------------------------------------------------------------------------------------------------
def test_of_several_recordings_each_is_left_out_and_of_one_its_cycles_in_six_blocks() -> None:
    one, two, none = (session_of(WAVE, np.full(240, bool(k))) for k in (1, 1, 0))
    folds = folds_of([one, none, two])
    assert [[fold.rest, [seen for seen, _ in fold.left_out]] for fold in folds] == [[[two], [one]], [[one], [two]]]
    assert folds[0].left_out[0][1].all()
    kept = np.ones(240, dtype=bool)
    kept[200:] = False
    single = session_of(WAVE, kept, np.repeat(np.arange(12), 20))
    folds = folds_of([single, none])
    assert len(folds) == 6
    # Ten cycles are fitted: two each in four of the blocks, one in the others.
    left = [sorted(set(single.cycle[mask])) for fold in folds for _, mask in fold.left_out]
    assert left == [[0, 1], [2, 3], [4, 5], [6, 7], [8], [9]]
    for fold in folds:
        (rest,), ((seen, mask),) = fold.rest, fold.left_out
        assert seen is single  # whose offset is its own, as that of a recording that is left out
        assert not (rest.fitted & mask).any()
        assert (rest.fitted | mask).sum() == 200
    assert len(folds_of([session_of(WAVE, None, np.repeat(np.arange(3), 80))])) == 3
    assert folds_of([session_of(WAVE)]) == []
    # Of a recording whose later cycles lie in a gap there is nothing that could be left out.
    begun = session_of(WAVE, np.arange(240) < 20, np.repeat(np.arange(12), 20))
    assert folds_of([begun]) == []
    twice = session_of(WAVE, np.arange(240) < 21, np.repeat(np.arange(12), 20))
    assert len(folds_of([twice])) == 2


def test_of_two_recordings_of_several_cycles_the_same_third_of_both_is_left_out_too() -> None:
    one = session_of(WAVE, None, np.repeat(np.arange(12), 20))
    two = session_of(WAVE, None, np.repeat(np.arange(6), 40))
    folds = thirds_of([one, two], STANDARD)
    left = [[sorted(set(seen.cycle[mask])) for seen, mask in fold.left_out] for fold in folds]
    assert left == [[[0, 1, 2, 3], [0, 1]], [[4, 5, 6, 7], [2, 3]], [[8, 9, 10, 11], [4, 5]]]
    for fold in folds:
        assert [seen for seen, _ in fold.left_out] == [one, two]
        for rest, (seen, mask) in zip(fold.rest, fold.left_out, strict=True):
            assert rest.conditions is seen.conditions
            assert (rest.fitted ^ mask).all()
    # Not of one that has two rises, nor of three, nor of one.
    short = session_of(WAVE[:40], None, np.repeat(np.arange(2), 20))
    for sessions in ([one, short], [one, two, one], [one]):
        assert thirds_of(sessions, STANDARD) == []


@pytest.mark.parametrize(("count", "largest", "folds"), [(12, 1, 12), (13, 3, 6), (40, 7, 6)])
def test_more_than_twelve_recordings_are_left_out_in_six_groups(count: int, largest: int, folds: int) -> None:
    sessions = [session_of(WAVE) for _ in range(count)]
    found = folds_of(sessions)
    groups = [[sessions.index(seen) for seen, _ in fold.left_out] for fold in found]
    assert (len(groups), max(map(len, groups))) == (folds, largest)
    assert sorted(k for group in groups for k in group) == list(range(count))  # each once, and nothing else
    for fold, group in zip(found, groups, strict=True):
        assert fold.rest == [one for k, one in enumerate(sessions) if k not in group]
    if count > 12:
        assert all(len({k % 6 for k in group}) > 1 for group in groups)  # of six kinds that take turns, none is gone


def test_gains_are_counted_in_their_standard_errors() -> None:
    gains = np.array([1.0, 3.0, 8.0])
    assert _in_standard_errors(gains) == pytest.approx(4.0 / (np.std(gains, ddof=1) / math.sqrt(3.0)))
    assert _in_standard_errors(gains[:2]) == pytest.approx(2.0)
    assert _in_standard_errors(np.array([2.0])) == pytest.approx(2e300)
    assert _in_standard_errors(np.array([-2.0, -2.0])) < -1e299


@pytest.mark.parametrize(("fitted", "least"), [(0.2, 0.25), (0.5, 0.375), (0.8, 0.6), (0.839, 0.62925), (0.841, 0.25)])
def test_an_extension_must_foresee_nearly_what_it_fitted(
    monkeypatch: pytest.MonkeyPatch, fitted: float, least: float
) -> None:
    """A quarter, and three quarters of the share that it fits, where it leaves more than a law does: 0.16."""
    monkeypatch.setattr(
        _validation, "error_of", lambda sessions, model: 2.0 * (math.sqrt(1.0 - fitted) if model == "it" else 1.0)
    )
    for by, stands in ((1.0001, True), (0.9999, False)):
        known: Any = SimpleNamespace(
            sessions=[], thresholds=STANDARD,
            errors=lambda model, way, by=by: np.array([3.0, 5.0]) * (1.0 - by * least if model == "it" else 1.0),
            _schemes=[None],
        )  # fmt: skip
        assert LeftOut.is_validated(known, "it", "plain") is stands  # type: ignore[arg-type]
    either: Any = SimpleNamespace(
        sessions=[], thresholds=STANDARD, _schemes=[None, None],
        errors=lambda model, way: np.array([1.0 - 1.0001 * least if model == "it" and way == good else 1.0]),
    )  # fmt: skip
    for good in (0, 1, 2):  # where one recording is foreseen by the other, or a third of both by the rest
        assert LeftOut.is_validated(either, "it", "plain") is (good < 2)  # type: ignore[arg-type]


def test_models_are_apart_and_off_by_the_rms_of_what_is_fitted() -> None:
    kept = np.arange(240) > 100
    sessions = [session_of(WAVE, kept), session_of(0.5 * WAVE[:100], reading=0.5 * WAVE[:100] + 0.3)]
    other = replace(MODEL, gain=1.2)
    for first, second in ((MODEL, other), (other, MODEL)):
        off = [(residual_of(s, first) - residual_of(s, second))[s.fitted] for s in sessions]
        assert rms_difference(sessions, first, second) == pytest.approx(math.sqrt(np.mean(np.concatenate(off) ** 2)))
    left = np.concatenate([residual_of(s, MODEL)[s.fitted] for s in sessions])
    assert error_of(sessions, MODEL) == pytest.approx(math.sqrt(np.mean(left**2)))
    assert error_of([], MODEL) == 0.0


@pytest.mark.parametrize(("ratio", "is_beyond"), [(9.99, False), (10.01, True)])
def test_an_effect_beyond_ten_times_what_was_fitted_is_no_knowledge(ratio: float, is_beyond: bool) -> None:
    """Of what moves the fitted part by less than what counts, ten times that."""

    def extended(amount: float, names: tuple[str, ...] = ("a", "b")) -> Any:
        return SimpleNamespace(
            parts=[SimpleNamespace(name=name) for name in names],
            without=lambda name: extended(0.0 if name == "b" else amount, tuple(n for n in names if n != name)),
            simulate=lambda load: 5.0 + amount * load,
        )

    swing = np.resize([-1.0, 1.0], 40)
    enough = STANDARD.imperfection / STANDARD.departure  # of which an imperfection is no more than its law may miss
    for small in (1.01 * enough, 0.99 * enough, 1e-6):
        within = max(small, STANDARD.material)
        seen, unseen, every = np.ones(40, dtype=bool), np.zeros(40, dtype=bool), small * swing
        fitted = SimpleNamespace(conditions=every, fitted=seen, judged=unseen)
        held = SimpleNamespace(conditions=7.0 + ratio * within * swing, fitted=unseen, judged=seen)
        found = extrapolating_effect([fitted, held], extended(1.0), STANDARD)  # type: ignore[list-item]
        assert found == ("b" if is_beyond and small < enough else None)
