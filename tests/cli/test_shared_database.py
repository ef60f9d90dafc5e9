"""`optimize` and `identify` on the database of a running server."""

from __future__ import annotations

import json
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.cli.conftest import Gaitswarm, WriteJson
from tests.examples.commands import synthesize
from tests.examples.forked import ForkedCommand
from tests.examples.jobs import SMALL_SPEC
from tests.examples.processes import eventually, line_with
from tests.examples.walks import SHORT_WALK

pytestmark = pytest.mark.slow

IN_PROCESS = ("--evaluator", "in-process")


@pytest.fixture(scope="module")
def db(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One for all tests: each looks at jobs of its own, and leaves none that runs."""
    return tmp_path_factory.mktemp("shared-database") / "jobs.db"


@pytest.fixture(scope="module")
def server(db: Path) -> Iterator[str]:
    process = ForkedCommand(
        "serve", "--port", "0", *IN_PROCESS, "--db", db,
        environment={"GAITSWARM_CACHE": "0"},
    )  # fmt: skip
    yield line_with(process.stderr, r"(http://[\d.:]+) and runs queued jobs").group(1)
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=60)
    assert process.returncode == 0


def test_optimize_keeps_its_job_while_a_server_runs(
    small_spec: Path, db: Path, server: str
) -> None:
    process = ForkedCommand("optimize", "--spec", small_spec, "--db", db, "--cpus", "1", "--json")
    out, err = process.communicate(timeout=120)
    assert process.returncode == 0, err
    assert json.loads(out)["state"] == "succeeded"
    assert "another process" not in err


def test_resuming_a_job_that_a_server_runs_follows_it_to_its_end(
    gaitswarm: Gaitswarm, write_json: WriteJson, db: Path, server: str
) -> None:
    spec = write_json(SMALL_SPEC | {"iterations": 40})
    job_id = gaitswarm("submit", "--spec", spec, "--server", server).out.strip()
    eventually(lambda: _job(gaitswarm, job_id, db)["iterations"] > 0)
    resumed = gaitswarm("optimize", "--resume", job_id, "--db", db, "--json")
    assert resumed.code == 0, resumed.err
    assert (resumed.json["state"], resumed.json["iterations"]) == ("succeeded", 40)
    assert "another process runs this job" in resumed.err
    assert "40/40 iterations: best" in resumed.err


def test_ctrl_c_stops_following_and_names_the_command_to_continue(
    gaitswarm: Gaitswarm, write_json: WriteJson, db: Path, server: str
) -> None:
    spec = write_json(SMALL_SPEC | {"iterations": 1_000_000})
    job_id = gaitswarm("submit", "--spec", spec, "--server", server).out.strip()
    eventually(lambda: _job(gaitswarm, job_id, db)["iterations"] > 0)
    process = ForkedCommand("optimize", "--resume", job_id, "--db", db)
    line_with(process.stderr, r"^\d+/\d+ iterations")
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert (process.returncode, out) == (130, "")
    assert "continues in another process" in err
    assert f"gaitswarm watch {job_id} --db {db}" in err
    assert _job(gaitswarm, job_id, db)["state"] == "running"
    assert gaitswarm("cancel", job_id, "--server", server).code == 0


@pytest.mark.thorough(
    "test_a_job_lost_to_another_process_is_followed_there_and_nothing_is_reported_twice"
)
def test_an_optimization_that_lost_its_lease_follows_its_job(
    gaitswarm: Gaitswarm, write_json: WriteJson, db: Path, server: str
) -> None:
    spec = write_json(SMALL_SPEC | {"iterations": 250})
    process = ForkedCommand("optimize", "--spec", spec, "--db", db, *IN_PROCESS, "--json")
    job_id = line_with(process.stderr, r"^job (\w+) in").group(1)
    line_with(process.stderr, r"^\d+/250 iterations")
    process.send_signal(signal.SIGSTOP)
    before = _job(gaitswarm, job_id, db)["iterations"]
    eventually(lambda: _job(gaitswarm, job_id, db)["iterations"] > before + 1)
    process.send_signal(signal.SIGCONT)
    out, err = process.communicate(timeout=120)
    assert process.returncode == 0, err
    assert json.loads(out)["state"] == "succeeded"
    assert "this process lost its lease" in err and "another process has taken the job over" in err


def test_an_optimization_cancelled_elsewhere_reports_it(
    gaitswarm: Gaitswarm, write_json: WriteJson, db: Path, server: str
) -> None:
    spec = write_json(SMALL_SPEC | {"iterations": 1_000_000})
    process = ForkedCommand("optimize", "--spec", spec, "--db", db, *IN_PROCESS, "--json")
    job_id = line_with(process.stderr, r"^job (\w+) in").group(1)
    assert gaitswarm("cancel", job_id, "--server", server).code == 0
    out, err = process.communicate(timeout=60)
    assert process.returncode == 1
    assert json.loads(out)["state"] == "cancelled"
    assert f"job {job_id} is cancelled" in err
    assert f"gaitswarm history {job_id} --db {db}" in err


@pytest.mark.thorough("test_a_log_is_recorded_once_fitted_and_judged")
def test_identify_follows_runs_that_a_server_claims(
    gaitswarm: Gaitswarm, write_json: WriteJson, db: Path, tmp_path: Path, server: str
) -> None:
    walk = write_json(SHORT_WALK | {"cycle_time": 0.8, "cycles": 2}, "walk.json")
    log = tmp_path / "twin.csv"
    of_walk = ("--design", "published:A", "--scenario", walk)
    assert synthesize(*of_walk, "-o", log).code == 0
    recording = gaitswarm("record", log, *of_walk, "--db", db).out.strip()
    fitted = gaitswarm(
        "identify", recording, "--variables", "body_mass", "--runs", "3", "--db", db, *IN_PROCESS,
        "--particles", "4", "--iterations", "15", "--json",
    )  # fmt: skip
    assert fitted.code == 0, fitted.err
    assert len(fitted.json["jobs"]) == 3
    assert "another process runs this job" in fitted.err


def _job(gaitswarm: Gaitswarm, job_id: str, db: Path) -> Any:
    return gaitswarm("status", job_id, "--db", db, "--json").json
