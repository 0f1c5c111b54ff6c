"""The examples in the docstrings of what users call say what comes out."""

from __future__ import annotations

import doctest
import inspect
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import smartshoe
from smartshoe.calibration.estimators import estimator
from smartshoe.gait import analyse

VERBS = [one for name in dir(smartshoe) if inspect.isfunction(one := getattr(smartshoe, name))] + [analyse, estimator]


def examples() -> Iterator[Any]:
    for verb in VERBS:
        home = inspect.getmodule(inspect.unwrap(verb))
        own = vars(home)[verb.__name__] if home is not None else verb
        parsed = doctest.DocTestParser().get_doctest(
            inspect.getdoc(own) or "", {"estimator": estimator}, verb.__name__, inspect.getsourcefile(own), 0
        )
        if parsed.examples:
            yield pytest.param(parsed, id=verb.__name__)


@pytest.mark.parametrize("example", list(examples()))
def test_an_example_gives_what_it_says(example: doctest.DocTest, tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.chdir(tmp_path)
    report: list[str] = []
    doctest.DocTestRunner().run(example, out=report.append)
    assert not report, "".join(report)


@pytest.mark.parametrize("verb", VERBS, ids=lambda verb: verb.__name__)
def test_a_verb_says_what_its_arguments_are(verb: Any) -> None:
    text = inspect.getdoc(verb) or ""
    names = list(inspect.signature(verb).parameters)
    _, section, listed = text.partition("Parameters\n----------\n")
    if len(names) > 2:
        assert section, f"{verb.__name__} has no section of parameters"
        first = [line for line in listed.split("\n\n")[0].splitlines() if not line.startswith(" ")]
        said = {name.strip(" *") for line in first for name in line.split(":")[0].split(",")}
        assert said == set(names)
