"""Forces through calibrated units against their truth, by activity and by what is known of the coverage.

pytest -m bank tests/gait/test_force_bank.py -s
"""

from __future__ import annotations

import numpy as np
import pytest
from calibrated import eight_calibrations, eight_diagnoses
from force_scoring import peak_errors, total_error

from simulators.people import Person, Run, Stand, Tiptoe, Walk, trial
from smartshoe.calibration import Calibration
from smartshoe.gait import Coverage, analyse, learn_coverage

MOVES = {"walk 0.8 m/s": Walk(0.8), "walk 1.3 m/s": Walk(1.3), "walk 2.0 m/s": Walk(2.0), "run 2.68 m/s": Run(2.68)}
BLADDER = {"hysteresis": {"strength": 0.02}}
# Both calibrations (then by diagnosis) and trial with hysteresis, or neither; drift of each zero over the trial.
UNITS = {"as built": (False, 0.0), "hysteresis 2 %, drift 5 %": (True, 0.05)}


@pytest.fixture(scope="module")
def calibrated() -> dict[bool, list[Calibration]]:
    return {False: eight_calibrations(), True: eight_diagnoses(bladder=BLADDER)}


@pytest.mark.bank
@pytest.mark.parametrize("kind", UNITS)
@pytest.mark.parametrize("name", MOVES)
def test_forces_of_moving(name: str, kind: str, calibrated: dict[bool, list[Calibration]]) -> None:
    move, (hysteresis, drift) = MOVES[name], UNITS[kind]
    calibrations, units = calibrated[hysteresis], {"*": {"bladder": BLADDER}} if hysteresis else None
    print()
    for outside in ("even", "midfoot"):
        rng = np.random.default_rng(5)
        made = trial(Person(), move, 120.0, rng, outside=outside, units=units, drift=drift)
        teach = trial(Person(), move, 60.0, rng, outside=outside, units=units)
        ways = {"share 0.8": Coverage(0.8)}
        if outside == "midfoot":
            if isinstance(move, Walk):
                ways["published midfoot"] = Coverage.midfoot(0.8)
            ways["learned course"] = learn_coverage(analyse(teach.recording, calibrations), teach.total_n)
        for way, coverage in ways.items():
            found = analyse(made.recording, calibrations, coverage=coverage)
            peaks, error = np.abs(peak_errors(found, made)), total_error(found, made)
            weight = found.forces.body_weight
            assert weight is not None
            print(
                f"{name:13s} {kind:26s} outside {outside:8s} {way:18s} RMSE {100 * error:5.2f} % of body weight, peaks"
                f" median {100 * np.median(peaks):5.2f} % 95 % below {100 * np.quantile(peaks, 0.95):5.2f} %,"
                f" weight {weight.value:.1f} ± {weight.sd:.1f} N"
            )
            if isinstance(move, Run):
                continue
            if outside == "even":
                assert error < 0.03
                assert np.median(peaks) < 0.03
            elif way == "learned course":
                # The trial's own mean course is the best there is: what is left the midfoot does unseen, step by step.
                own = learn_coverage(found, made.total_n)
                best = total_error(analyse(made.recording, calibrations, coverage=own), made)
                print(f"{'':58s} its own course     RMSE {100 * best:5.2f} %")
                assert error < 1.1 * best
                assert np.median(peaks) < 0.03


@pytest.mark.bank
@pytest.mark.parametrize("hysteresis", [False, True], ids=["as built", "hysteresis 2 %"])
def test_standing(hysteresis: bool, calibrated: dict[bool, list[Calibration]]) -> None:
    print()
    for seed in range(3):
        made = trial(
            Person(), ((Tiptoe(), 20.0), (Stand(), 40.0)), 60.0, np.random.default_rng(seed),
            units={"*": {"bladder": BLADDER}} if hysteresis else None,
        )  # fmt: skip
        found = analyse(made.recording, calibrated[hysteresis], coverage=0.8)
        total_n = found.forces.standing_total_n
        assert total_n is not None
        print(f"standing {'hysteresis 2 %' if hysteresis else 'as built':15s} total {total_n:.1f} N of 519.4 N")
        assert total_n == pytest.approx(519.4, rel=0.01)
