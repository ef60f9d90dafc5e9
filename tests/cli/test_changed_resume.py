"""Resuming a job after changes of its provenance: refused, or accepted on request."""

from __future__ import annotations

import os
import shutil
import sqlite3
import subprocess
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from gaitswarm.services.runtime import open_store
from gaitswarm.sim.robot import DEFAULT_ROBOT
from tests.cli.conftest import Finished, Gaitswarm
from tests.examples.paths import ROOT, copy_package
from tests.examples.processes import COMMAND_LINE, python

pytestmark = pytest.mark.slow


@pytest.fixture
def extended(finished: Finished, tmp_path: Path, gaitswarm: Gaitswarm) -> Finished:
    """A job of two iterations that are committed, and two that are not."""
    db = tmp_path / "jobs.db"
    shutil.copy(finished.db, db)
    assert gaitswarm("extend", finished.id, "--iterations", "4", "--db", db).code == 0
    return Finished(db, finished.job)


def resume(job: Finished, *options: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Go on with the job in a process of its own."""
    command = ["optimize", "--resume", job.id, "--db", str(job.db), "--evaluator", "in-process"]
    return python("-P", *COMMAND_LINE, *command, *options, environment=environment)


def changed_simulator(folder: Path, file: str, old: str, new: str) -> str:
    """PYTHONPATH of a gaitswarm whose simulator differs in one place."""
    changed = copy_package(folder) / "sim" / file
    text = changed.read_text(encoding="utf-8")
    assert old in text
    changed.write_text(text.replace(old, new), encoding="utf-8")
    return os.pathsep.join([str(folder), str(ROOT)])


def other_kernel_code(folder: Path) -> dict[str, str]:
    return {
        "PYTHONPATH": changed_simulator(
            folder, "kernel/emitted/tick.c", "CODE_LIMIT 65535", "CODE_LIMIT 255"
        )
    }


def another_robot_file(folder: Path) -> dict[str, str]:
    file = "robot/szabadka2/robot.toml"
    return {"PYTHONPATH": changed_simulator(folder, file, "\nfriction = 1.0", "\nfriction = 0.9")}


def no_compiler(folder: Path) -> dict[str, str]:
    """Neither a compiler, on the path or as a wheel, nor a kernel that one has left."""
    (folder / "ziglang.py").write_text("raise SystemExit(1)\n", encoding="utf-8")
    path = os.pathsep.join([str(folder), str(ROOT)])
    nowhere = dict.fromkeys(("PATH", "XDG_CACHE_HOME", "TMPDIR"), str(folder))
    return {"PYTHONPATH": path, "CC": ""} | nowhere


def history(job: Finished, gaitswarm: Gaitswarm) -> Any:
    return gaitswarm("history", job.id, "--db", job.db, "--json").json


@pytest.mark.thorough("test_a_job_whose_numbers_would_be_others_is_refused_until_that_is_accepted")
@pytest.mark.variants
@pytest.mark.parametrize(
    ("change", "said"),
    [
        (other_kernel_code, "changed simulation code"),
        (another_robot_file, f"the robot {DEFAULT_ROBOT} has changed"),
        (no_compiler, "no C compiler: backend reference instead of native"),
    ],
)
def test_a_job_does_not_mix_numbers_that_depend_on_something_else(
    change: Any, said: str, extended: Finished, tmp_path: Path, gaitswarm: Gaitswarm
) -> None:
    before = history(extended, gaitswarm)
    refused = resume(extended, **change(tmp_path))
    assert refused.returncode == 4, refused.stderr
    assert said in refused.stderr and "--accept-changes" in refused.stderr
    assert history(extended, gaitswarm) == before
    job = gaitswarm("status", extended.id, "--db", extended.db, "--json").json
    assert (job["state"], job["iterations"]) == ("queued", 2)


def test_an_accepted_change_is_recorded_from_its_iteration(
    extended: Finished, gaitswarm: Gaitswarm
) -> None:
    (record,) = extended.job["provenance"]
    digest = record["provenance"]["simulation"]["robot_digest"]
    with closing(sqlite3.connect(extended.db)) as connection, connection:
        change = "UPDATE jobs SET provenance = replace(provenance, ?, 'of another robot')"
        connection.execute(change, [digest])
    before = history(extended, gaitswarm)
    again = ("optimize", "--resume", extended.id, "--db", extended.db, "--evaluator", "in-process")
    refused = gaitswarm(*again)
    assert refused.code == 4 and "--accept-changes" in refused.err
    assert history(extended, gaitswarm) == before
    resumed = gaitswarm(*again, "--accept-changes")
    assert resumed.code == 0, resumed.err
    after = history(extended, gaitswarm)
    assert after["iterations"][:2] == before["iterations"]
    job = gaitswarm("status", extended.id, "--db", extended.db, "--json").json
    assert (job["state"], job["iterations"]) == ("succeeded", 4)
    assert after["provenance"] == job["provenance"]
    first, second = job["provenance"]
    assert (first["from_iteration"], second["from_iteration"]) == (0, 2)
    was, now = (entry["provenance"]["simulation"] for entry in (first, second))
    assert {field for field in was if was[field] != now[field]} == {"robot_digest"}
    assert (was["robot_digest"], now["robot_digest"]) == ("of another robot", digest)
    said = gaitswarm("status", extended.id, "--db", extended.db).out
    assert "computed by from iteration 2" in said and now["robot_digest"][:8] in said


def test_accept_changes_requires_resume(
    gaitswarm: Gaitswarm, small_spec: Path, new_db: Path
) -> None:
    refused = gaitswarm("optimize", "--spec", small_spec, "--db", new_db, "--accept-changes")
    assert refused.code == 2 and "accept-changes" in refused.err
    assert not new_db.exists()


def test_consent_reaches_a_job_in_a_database_and_on_a_server(
    gaitswarm: Gaitswarm, small_spec: Path, db: Path, place: Callable[[Path], list[str]]
) -> None:
    job_id = gaitswarm("submit", "--spec", small_spec, "--db", db).out.strip()
    where = place(db)
    for accepted, options in ((True, ["--accept-changes"]), (False, [])):
        assert gaitswarm("pause", job_id, *where).code == 0
        assert gaitswarm("resume", job_id, *options, *where).code == 0
        with closing(open_store(str(db))) as store:
            assert store.job(job_id).accepts_changes is accepted
