"""What a person meets in the first trials: drift while standing, lost samples, part of the units."""

from __future__ import annotations

import numpy as np
import pytest
from trials import analysed, loads_of, recorded, walked

from simulators.people import Person, Stand, trial
from smartshoe.errors import UsageError
from smartshoe.gait import analyse


def test_a_total_that_runs_away_while_standing_is_said_and_a_steady_one_is_not() -> None:
    made = trial(Person(), Stand(), 30.0, np.random.default_rng(5), sensors=False, noise_n=1.0)
    columns = loads_of(made)
    assert "standing_drifts" not in {flag.kind for flag in analyse(recorded(made.time_s, columns)).flags}
    columns["left_heel_n"] += 1.0 * made.time_s
    (flag,) = [f for f in analyse(recorded(made.time_s, columns)).flags if f.kind == "standing_drifts"]
    assert "lift each foot" in flag.says


def test_samples_lost_one_by_one_cost_no_stride() -> None:
    columns = loads_of(walked())
    rng = np.random.default_rng(6)
    for values in columns.values():
        values[rng.random(values.size) < 0.03] = np.nan
    found = analyse(recorded(walked().time_s, columns), coverage=0.8)
    assert found.summary["strides"] == analysed().summary["strides"]
    wanted = analysed().forces.mean_total_n
    assert found.forces.mean_total_n == pytest.approx(wanted, rel=2e-3)


def test_heel_and_toe_alone_are_not_taken_for_exchanged_columns() -> None:
    columns = {name: values for name, values in loads_of(walked()).items() if "meta" not in name}
    found = analyse(recorded(walked().time_s, columns))
    assert {flag.kind for flag in found.flags} == {"missing_unit"}
    assert found.indices["left"]["sequence_error_percent"] is None


def test_a_heel_that_one_shoe_lacks_is_no_matter_of_clocks() -> None:
    columns = {name: values for name, values in loads_of(walked()).items() if name != "left_heel_n"}
    found = analyse(recorded(walked().time_s, columns))
    assert [flag.kind for flag in found.flags] == ["missing_unit"]
    assert "heel strikes late" in found.flags[0].says


def test_an_estimator_of_another_name_is_refused_even_where_none_is_needed() -> None:
    with pytest.raises(UsageError, match="use one of"):
        analyse(walked().recording, estimator="foo")


def test_strides_of_one_foot_do_not_weigh_while_the_other_lacks_a_unit() -> None:
    columns = loads_of(walked())
    columns["right_toe_n"][walked().time_s > 0.6 * walked().time_s[-1]] = np.nan
    found = analyse(recorded(walked().time_s, columns), coverage=0.8)
    assert found.forces.mean_total_n == pytest.approx(analysed().forces.mean_total_n, rel=0.01)
