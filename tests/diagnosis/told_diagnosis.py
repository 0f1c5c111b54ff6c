"""A diagnosis whose every step answers what it is told to, for tests of how it is put together."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from test_procedure_by_hand import AFTER, BEFORE, MODEL, SCALE, STANDARD, _left

from smartshoe.diagnosis import _force, _procedure, _withheld
from smartshoe.diagnosis._force import Compensation, ForceError
from smartshoe.diagnosis._procedure import diagnosed
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.effects import effect

FAULT: Any = SimpleNamespace(kind="gaps", recording=0, error=0.0, lines_hz=())
SCREENED = ("delay", "flexible_lag", "linear_leak", "dead_band", "rate_gain", "warm_up")
SCREENING = tuple((name, float(k)) for k, name in enumerate(SCREENED))
PLAIN_N, EXTENDED_N = ForceError(8.0, 9.0), ForceError(6.0, 7.0)
FILTER: Any = SimpleNamespace(not_inverted=(), moved_by_the_clock={}, lags_left_s={})  # undoes all


@dataclass(frozen=True)
class _Session:
    """Three samples, of which some may be fitted."""

    name: str
    index: int
    fitted: NDArray[np.bool_]
    usable: NDArray[np.bool_] = field(default_factory=lambda: np.ones(3, dtype=bool))

    @property
    def judged(self) -> NDArray[np.bool_]:
        return self.usable & ~self.fitted

    @property
    def conditions(self) -> Any:
        return SimpleNamespace(time_s=np.arange(3.0), before={})

    @property
    def recording(self) -> Any:
        return SimpleNamespace(sensor=SimpleNamespace(unit=SCALE.unit))


class _AtFullRate(_Session):
    """The same, read at 20 Hz."""

    @property
    def conditions(self) -> Any:
        return SimpleNamespace(step_s=0.05)


FINE: Any = _AtFullRate("fine", 0, np.array([True, False, True]))


def told_parts(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Every step of a diagnosis by what it is told to answer."""
    fitted, held = _Session("fitted", 0, np.array([True, True, False])), _Session("held", 1, np.zeros(3, dtype=bool))
    given = SimpleNamespace(
        sessions=[held, fitted], fine=[FINE], scale=SCALE, limits=["limit"], start="start",
        excitation=SimpleNamespace(
            goes_with_the_clock=False, hides=lambda effect: False, shows=lambda _: True, tells_apart=frozenset(),
            channels=frozenset(),
        ),
        is_no_unit=False, is_integral=False, clocks=(), is_moved=False, thresholds=STANDARD,
    )  # fmt: skip
    extended = MODEL.with_part("linear_leak").with_part("delay", np.array([0.2]))
    core = SimpleNamespace(effect=effect("second_relaxation"), size=0.5, name="second_relaxation", kin=())
    other = SimpleNamespace(effect=effect("dead_band"), size=0.25, name="dead_band", kin=())
    found = SimpleNamespace(
        fit=SimpleNamespace(model=extended), baseline=SimpleNamespace(model=MODEL), members=(core, core, other),
        can_validate=True, refused=(), cancelling_names=(), best_single=None, screening=SCREENING,
        likeness=np.eye(6), own_gains=(), zero_changes=(), nearest_law=None, together=(),
    )  # fmt: skip
    kinds = [_left(0.3), _left(0.02), _left(0.01)]  # before, after, and of what was learnt
    kinds[2].memory, kinds[2].size, kinds[2].sd_of_mean = "memory", 0.07, lambda lasts_s: ("wanders", lasts_s)
    made = SimpleNamespace(
        given=given,
        found=found,
        kinds=kinds,
        names=[],
        zeros=[],
        seen={},
        sizes={"linear_leak": 0.1, "delay": 0.3},
        not_undone=[],
        limit_calibration_off=[],
        limit_unsound_readings=[],
        unproven=0.0,
        beyond=0.0,
        judged=1.0,
        off=0.05,
        wall_ratio=[],
    )

    def structure(sessions: Any, residuals: Any, thresholds: Any, quick: Any = None, fine: Any = None) -> Any:
        made.seen.setdefault("structure", []).append((list(sessions), list(residuals)))
        made.seen.setdefault("quick", []).append(quick)
        made.seen.setdefault("fine", []).append(fine)
        return made.kinds[len(made.seen["structure"]) - 1]

    def answer(name: str, value: Any) -> None:
        def called(*args: Any, **named: Any) -> Any:
            made.seen[name] = (args, named)
            return value(*args) if callable(value) else value

        monkeypatch.setattr(_withheld if hasattr(_withheld, name) else _procedure, name, called)

    def cause(name: Any, *_: Any) -> Any:
        return SimpleNamespace(name=name.name, size=made.sizes[name.name], rivals=(f"rival of {name.name}",))

    answer("prepared", given)
    answer("infer_with_gas_check", found)
    answer("lags_of_judged", {})
    answer("residual_of", lambda session, model: f"{getattr(session, 'name', session)} {len(model.parts)}")
    monkeypatch.setattr(_procedure, "residual_structure", structure)
    answer("repeating_structure", lambda fine, left, thresholds: (fine, left))
    answer("names_of", lambda *_: tuple(made.names))
    answer("reason_of_another_kind", lambda name, *_: "it turned" if name.name == "turned" else None)
    answer("zeros_of", lambda *_: tuple(made.zeros))
    answer("may_be_remembered", lambda *_: False)
    answer("may_be_of_the_load_cell", lambda *_: False)
    answer("errors", lambda fine, model: AFTER if len(model.parts) else BEFORE)
    answer("fitted_rms", lambda *_: made.off)
    answer("cause_of", cause)
    answer("zero_cause_of", lambda zero, *_: SimpleNamespace(name="zero", size=zero.size, rivals=("of zero",)))
    answer("_with_offset", "with offset")
    answer("noise_without_memory", lambda *_: [])
    answer("noise_with_memory", ["noise"])
    answer("joint_parameters", ({"p": 1}, ((1.0,),)))
    answer("limit_wall_ratio", lambda *_: made.wall_ratio)
    answer("limit_not_undone", lambda *_: list(made.not_undone))
    answer("own_zeros", None)
    answer("mean_offset", 0.02)
    monkeypatch.setattr(_force, "mean_offset", lambda *_: 0.02)
    answer("limit_calibration_off", lambda *_: list(made.limit_calibration_off))
    answer("limit_unsound_readings", lambda *_: list(made.limit_unsound_readings))
    answer("compensation", lambda fine, model, *_: Compensation(fine, model, EXTENDED_N, PLAIN_N, EXTENDED_N, FILTER))
    answer("next_experiment", "next")
    answer("_trace", "trace")
    answer("sentence_of", "sentence")
    answer("names_in", "names")
    answer("unexplained_remark", "left")
    answer("held_out_excess", 0.0)
    answer("beyond_noise", lambda *_: made.beyond)
    answer("held_out_rms", lambda *_: made.judged)
    answer("untested_rms", lambda *_: made.unproven)
    answer("load_cycles", 9)
    return made


def run_diagnosis(parts: Any, thresholds: Thresholds = STANDARD) -> Any:
    said: list[str] = []
    integrity: Any = SimpleNamespace(faults=(FAULT,))
    result = diagnosed(["recordings"], 1, integrity, thresholds, said.append)  # type: ignore[list-item]
    assert said == ["judging on held-out data"]
    return result


def name_of(name: str, kind_only: bool = False, size: float = 0.1, is_sure: bool = True, kind: float = 0.9) -> Any:
    known, member = effect("delay" if name == "turned" else name), SimpleNamespace(size=size, name=name, kin=())
    return SimpleNamespace(
        name=name,
        kind_only=kind_only,
        is_sure=is_sure,
        effect=known,
        member=member,
        kind_probability=kind,
        law_in_place=None,
    )
