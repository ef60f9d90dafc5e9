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
