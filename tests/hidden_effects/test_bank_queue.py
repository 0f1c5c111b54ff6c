"""The bank over a sweep's queue: each case once, whatever is lost, and none of another code's."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from bank_queue import BankCase, BankCases, rows_over
from bank_worlds import Job

JOBS = [Job("own", kind, index) for kind in ("single", "two") for index in range(3)]


def told(case: BankCase) -> str:
    with Path(case.job["folder"]).open("a") as file:
        file.write(f"{case.name}\n")
    return json.dumps({key: case.job[key] for key in ("world", "kind", "index")})


def test_each_case_is_computed_once_and_rows_come_in_the_order_of_the_jobs(tmp_path: Path) -> None:
    jobs = [Job(job.world, job.kind, job.index, str(tmp_path / "told")) for job in JOBS]
    first = list(rows_over(jobs, tmp_path / "queue", 1, shard=(2, 2), compute=told))
    assert [(row["kind"], row["index"]) for row in first] == [("single", 1), ("two", 0), ("two", 2)]
    every = list(rows_over(jobs, tmp_path / "queue", 1, compute=told))
    assert [(row["world"], row["kind"], row["index"]) for row in every] == [job.key for job in jobs]
    names = (tmp_path / "told").read_text().split()
    assert len(names) == len(set(names)) == len(jobs)


def test_a_case_that_was_lost_is_computed_again_and_the_others_are_not(tmp_path: Path) -> None:
    jobs = [Job(job.world, job.kind, job.index, str(tmp_path / "told")) for job in JOBS]
    every = list(rows_over(jobs, tmp_path / "queue", 1, compute=told))
    lost = BankCases(jobs).name(4)
    (tmp_path / "queue" / "cases" / f"{lost}.json").unlink()
    (tmp_path / "told").unlink()
    assert list(rows_over(jobs, tmp_path / "queue", 1, compute=told)) == every
    assert (tmp_path / "told").read_text().split() == [lost]


def test_other_code_makes_other_cases(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    before = BankCases(JOBS)
    names = {before.name(number) for number in range(len(JOBS))}
    assert len(names) == len(JOBS)
    (tmp_path / "diagnosis.py").write_text("changed = True\n")
    monkeypatch.setattr("bank_queue.HERE", tmp_path)
    after = BankCases(JOBS)
    assert names.isdisjoint(after.name(number) for number in range(len(JOBS)))
