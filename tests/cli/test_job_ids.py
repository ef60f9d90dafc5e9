"""Unique prefixes of job ids."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from gaitswarm.cli.options import full_id
from gaitswarm.jobs.open import open_jobs
from gaitswarm.services.optimizer.errors import InvalidRequest
from tests.cli.conftest import Finished, Gaitswarm
from tests.examples.commands import synthesize
from tests.setup import command_line

pytestmark = pytest.mark.slow


def test_the_beginning_of_an_id_is_enough(
    gaitswarm: Gaitswarm, finished: Finished, place: Callable[[Path], list[str]]
) -> None:
    where = place(finished.db)
    for command in ("status", "best", "history"):
        result = gaitswarm(command, finished.id[:5], *where, "--json")
        assert result.json == gaitswarm(command, finished.id, *where, "--json").json


def test_the_beginning_may_stand_before_the_options_that_say_where(
    gaitswarm: Gaitswarm, finished: Finished
) -> None:
    result = gaitswarm("status", "--json", finished.id[:5], "--db", finished.db)
    assert result.json["id"] == finished.id


COMMANDS = {
    "audit": "--job ID",
    "best": "ID --json",
    "cancel": "ID",
    "certify": "ID --worlds 1 --scenarios 7 --evaluator in-process",
    "delete": "ID --yes",
    "diff": "ID --json",
    "evidence": "ID --output FILE.zip",
    "export": "ID --output FILE.csv",
    "extend": "ID --iterations 3",
    "failures": "ID --json",
    "firmware": "ID --output FILE",
    "fork": "ID --from 1 --iterations 3",
    "front": "ID --json",
    "history": "ID --json",
    "importance": "ID --json",
    "keep": "ID",
    "label": "ID --tag found",
    "list": "--forks-of ID --json",
    "optimize": "--resume ID --json",
    "parameters": "ID",
    "pause": "ID",
    "plot convergence": "ID --output FILE.svg",
    "plot front": "ID --output FILE.svg",
    "plot surface": "--design job:ID --output FILE.svg",
    "preferences": "ID --for 0.0 --json",
    "prioritize": "ID --priority 1",
    "rank": "ID --preference B --json",
    "record": "MEASURED --design job:ID --scenario 1 --cycles 2",
    "resume": "ID",
    "robustness": "ID --samples 45 --json",
    "simulate": "--design job:ID --json",
    "status": "ID --json",
    "verdict": "ID --json",
    "submit": "--start-from ID,ID --json",
    "targets": "ID",
    "trajectories": "ID --output FILE",
    "validate": "MEASURED --design job:ID --scenario 1 --cycles 2 --json",
    "verify": "ID --replay 0",
    "watch": "ID --json",
}
"""What is given to each command that takes the id of a job."""

OTHERWISE = {
    **dict.fromkeys(("cancel", "pause", "prioritize", "resume"), 4),
    "targets": 2,
}
"""Exit codes that are not 0, as the job has ended and tunes a drive."""


def test_all_commands_that_take_an_id_are_among_them() -> None:
    # The id of a recording is given in full.
    assert command_line.taking(r"\bID\b") == COMMANDS.keys()


@pytest.fixture(scope="session")
def measured(finished: Finished, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A log of the walk of the job's best."""
    path = tmp_path_factory.mktemp("measured") / "walk.csv"
    walk = ("--design", f"job:{finished.id}", "--scenario", "1", "--cycles", "2")
    made = synthesize(*walk, "--output", path, "--db", finished.db)
    assert made.code == 0, made.err
    return path


@pytest.mark.variants("best", "list", "optimize", "simulate", "submit")
@pytest.mark.parametrize("name", COMMANDS)
def test_it_is_enough_wherever_a_command_takes_an_id(
    gaitswarm: Gaitswarm,
    finished: Finished,
    request: pytest.FixtureRequest,
    tmp_path: Path,
    name: str,
) -> None:
    db = tmp_path / "jobs.db"
    shutil.copy(finished.db, db)
    typed = COMMANDS[name].replace("ID", finished.id[:5])
    if "MEASURED" in typed:
        typed = typed.replace("MEASURED", str(request.getfixturevalue("measured")))
    words = typed.replace("FILE", str(tmp_path / "made")).split()
    result = gaitswarm(*name.split(), *words, "--db", db)
    # An unknown id is exit code 3.
    assert result.code == OTHERWISE.get(name, 0), result.err


def test_a_beginning_of_no_id_is_refused_as_any_unknown_one(
    gaitswarm: Gaitswarm, finished: Finished
) -> None:
    result = gaitswarm("status", "zzzz", "--db", finished.db)
    assert (result.code, result.err.strip()) == (3, "gaitswarm: there is no job 'zzzz'")


def test_a_beginning_of_several_ids_is_refused_with_these(
    finished: Finished, tmp_path: Path
) -> None:
    shutil.copy(finished.db, tmp_path / "jobs.db")
    with open_jobs(None, str(tmp_path / "jobs.db")) as jobs:
        ids = [jobs.submit(controller="pi").id for _ in range(40)]
        shared = next(a[:1] for a in ids if sum(b[:1] == a[:1] for b in ids) > 1)
        with pytest.raises(InvalidRequest, match=f"'{shared}' matches .*; type more characters"):
            full_id(jobs, shared)
        assert full_id(jobs, ids[0]) == ids[0]
