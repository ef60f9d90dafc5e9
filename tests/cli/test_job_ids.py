"""Ids of jobs may be shortened as long as one job is meant."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from cli.inputs.job_ids import full_id
from gaitswarm.jobs.open import open_jobs
from services.optimizer.errors import InvalidRequest
from tests.cli.conftest import Finished, Gaitswarm

pytestmark = pytest.mark.slow


def test_the_beginning_of_an_id_is_enough(
    gaitswarm: Gaitswarm, finished: Finished, place: Callable[[Path], list[str]]
) -> None:
    where = place(finished.db)
    for command in ("status", "best", "history"):
        told = gaitswarm(command, finished.id[:5], *where, "--json")
        assert told.json == gaitswarm(command, finished.id, *where, "--json").json


def test_the_beginning_may_stand_before_the_options_that_say_where(
    gaitswarm: Gaitswarm, finished: Finished
) -> None:
    told = gaitswarm("status", "--json", finished.id[:5], "--db", finished.db)
    assert told.json["id"] == finished.id


@pytest.mark.parametrize(
    "command",
    [
        ("diff", "ID", "ID", "--json"),
        ("importance", "ID", "--json"),
        ("compare", "job:ID", "--scenario", "3", "--json"),
        ("plot", "surface", "--design", "job:ID", "--output", "FILE"),
        ("simulate", "--design", "job:ID", "--scenario", "3", "--json"),
        ("targets", "ID", "--json"),
        ("parameters", "ID", "--json"),
        ("audit", "--job", "ID"),
        ("list", "--forks-of", "ID", "--json"),
        ("optimize", "--resume", "ID", "--json"),
        ("optimize", "--start-from", "ID,ID", "--iterations", "0"),
    ],
    ids=lambda command: " ".join(command[:2]),
)
def test_it_is_enough_wherever_a_command_takes_an_id(
    gaitswarm: Gaitswarm, finished: Finished, tmp_path: Path, command: tuple[str, ...]
) -> None:
    shutil.copy(finished.db, tmp_path / "jobs.db")

    def told(job_id: str) -> tuple[int, str, str]:
        words = [word.replace("ID", job_id) for word in command]
        words = [str(tmp_path / "made.svg") if word == "FILE" else word for word in words]
        result = gaitswarm(*words, "--db", tmp_path / "jobs.db")
        return result.code, result.out, result.err

    whole, beginning = told(finished.id), told(finished.id[:5])
    assert beginning[0] == whole[0]
    # Progress and places differ; what is said of the job does not.
    assert "there is no job" not in beginning[2] and "nothing is known" not in beginning[2]
    if "--json" in command and "optimize" not in command:
        without = (
            told[1].replace(finished.id, "").replace(finished.id[:5], "")
            for told in (whole, beginning)
        )
        assert len(set(without)) == 1


def test_a_beginning_of_no_id_is_refused_as_any_unknown_one(
    gaitswarm: Gaitswarm, finished: Finished
) -> None:
    told = gaitswarm("status", "zzzz", "--db", finished.db)
    assert (told.code, told.err.strip()) == (3, "gaitswarm: there is no job 'zzzz'")


def test_a_beginning_of_several_ids_is_refused_with_these(
    finished: Finished, tmp_path: Path
) -> None:
    shutil.copy(finished.db, tmp_path / "jobs.db")
    with open_jobs(None, str(tmp_path / "jobs.db")) as jobs:
        ids = [jobs.submit(controller="pi").id for _ in range(40)]
        shared = next(a[:1] for a in ids if sum(b[:1] == a[:1] for b in ids) > 1)
        with pytest.raises(InvalidRequest, match=f"'{shared}' fits .*; give more of it"):
            full_id(jobs, shared)
        assert full_id(jobs, ids[0]) == ids[0]
