"""Exit codes of errors and bugs."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import gaitswarm.jobs.open as gaitswarm_open
from gaitswarm.cli import embedded
from gaitswarm.cli.exit_codes import ExitCode
from gaitswarm.services.optimizer.errors import EvaluatorUnavailable, StoreUnavailable
from tests.cli.conftest import Finished, Gaitswarm
from tests.examples.forked import run_forked
from tests.examples.paths import ROOT
from tests.examples.processes import COMMAND_LINE, python

IN_PROCESS = ("--evaluator", "in-process")

BUFFERED = {"PYTHONUNBUFFERED": ""}
"""As the interpreter is by itself, which writes what is left at its end."""


def run(*arguments: str | Path, **options: Any) -> subprocess.CompletedProcess[str]:
    environment = BUFFERED | options.pop("environment", {})
    pipes = {"capture_output": False, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    return python(*COMMAND_LINE[1:], *arguments, environment=environment, **pipes | options)


def writing_commands(finished: Finished) -> dict[str, tuple[str | Path, ...]]:
    where = ("--db", finished.db)
    return {
        "help": ("--help",),
        "help of a command": ("list", "--help"),
        "version": ("--version",),
        "JSON, written as it is read": ("history", finished.id, *where, "--json"),
        "a table": ("status", finished.id, *where),
    }


WRITING = ["help", "help of a command", "version", "JSON, written as it is read", "a table"]


@pytest.mark.variants("a table-")
@pytest.mark.slow
@pytest.mark.parametrize("buffered", [BUFFERED, {"PYTHONUNBUFFERED": "1"}], ids=["", "unbuffered"])
@pytest.mark.parametrize("kind", WRITING)
def test_a_full_device_is_exit_code_5(
    finished: Finished, kind: str, buffered: dict[str, str]
) -> None:
    with Path("/dev/full").open("w") as full:
        done = run(*writing_commands(finished)[kind], stdout=full, environment=buffered)
    assert done.returncode == ExitCode.UNAVAILABLE
    assert done.stderr == "gaitswarm: standard output cannot be written: No space left on device\n"


@pytest.mark.variants("help of a command")
@pytest.mark.slow
@pytest.mark.parametrize("kind", WRITING)
def test_a_reader_that_has_seen_enough_is_no_error(finished: Finished, kind: str) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    try:
        done = run(*writing_commands(finished)[kind], stdout=writing)
    finally:
        os.close(writing)
    assert (done.returncode, done.stderr) == (ExitCode.OK, "")


@pytest.mark.thorough("test_a_full_device_is_exit_code_5")
@pytest.mark.variants
@pytest.mark.slow
@pytest.mark.parametrize("closed", [">&-", "2>&-", "<&- >&- 2>&-"])
def test_closed_streams_are_no_error(finished: Finished, closed: str) -> None:
    program = f'"$0" "$@" {closed}'
    command = (sys.executable, *COMMAND_LINE, "status", finished.id, "--db", str(finished.db))
    done = subprocess.run(
        ["/bin/sh", "-c", program, *command],
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert (done.returncode, done.stderr) == (ExitCode.OK, "")


@pytest.mark.thorough("test_a_full_device_is_exit_code_5")
@pytest.mark.slow
def test_messages_that_cannot_be_written_change_no_exit_code(finished: Finished) -> None:
    with Path("/dev/full").open("w") as full:
        done = run("status", "nosuchjob", "--db", finished.db, stderr=full)
        watched = run("watch", finished.id, "--db", finished.db, stderr=full)
    assert (done.returncode, watched.returncode) == (ExitCode.NOT_FOUND, ExitCode.OK)


def test_a_data_directory_that_cannot_be_created_is_exit_code_5_with_a_remedy(
    gaitswarm: Gaitswarm, small_spec: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # A file, so that it cannot be written by root either.
    monkeypatch.setenv("XDG_DATA_HOME", str(small_spec))
    monkeypatch.delenv("GAITSWARM_DB", raising=False)
    done = gaitswarm("optimize", "--spec", small_spec, *IN_PROCESS)
    assert done.code == ExitCode.UNAVAILABLE
    assert f"cannot make {small_spec}/gaitswarm for the database" in done.err
    assert "--db" in done.err and "XDG_DATA_HOME" in done.err
    assert "Traceback" not in done.err


@pytest.mark.thorough("test_where_the_cache_cannot_be_written_a_private_one_serves")
@pytest.mark.slow
def test_unwritable_cache_and_home_directories_are_no_error(
    small_spec: Path, tmp_path: Path
) -> None:
    no_folder = str(small_spec)
    of_user = {"XDG_CACHE_HOME": no_folder, "HOME": no_folder, "TMPDIR": str(tmp_path)}
    db = tmp_path / "jobs.db"
    options = ("--spec", small_spec, "--db", db, *IN_PROCESS)
    done = run_forked("optimize", *options, environment=of_user)
    assert done.returncode == ExitCode.OK, done.stderr
    picture = tmp_path / "surface.png"
    drawn = run_forked("plot", "surface", "--output", picture, environment=of_user)
    assert drawn.returncode == ExitCode.OK, drawn.stderr
    assert picture.exists()
    assert "Traceback" not in done.stderr + drawn.stderr


def test_a_bug_is_exit_code_70_with_its_traceback(
    gaitswarm: Gaitswarm, monkeypatch: pytest.MonkeyPatch
) -> None:
    def with_a_bug(*_: object, **__: object) -> None:
        raise ZeroDivisionError("of all numbers")

    monkeypatch.setattr(gaitswarm_open, "open_jobs", with_a_bug)
    result = gaitswarm("list")
    assert result.code == ExitCode.BUG
    assert "Traceback" in result.err and "ZeroDivisionError: of all numbers" in result.err
    assert "this is a bug" in result.err


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (OSError(28, "No space left on device", "/data/jobs.db"), "/data/jobs.db: No space left"),
        (PermissionError(13, "Permission denied", "/data"), "/data: Permission denied"),
        (StoreUnavailable("the database is away"), "the database is away"),
        (MemoryError(), "out of memory"),
        (RuntimeError("can't start new thread"), "out of memory (or of threads)"),
        (ImportError("x.so: failed to map segment from shared object"), "out of memory"),
    ],
)
def test_refusals_of_the_operating_system_are_no_bugs(
    gaitswarm: Gaitswarm, monkeypatch: pytest.MonkeyPatch, error: Exception, said: str
) -> None:
    def refused(*_: object, **__: object) -> None:
        raise error

    monkeypatch.setattr(gaitswarm_open, "open_jobs", refused)
    result = gaitswarm("list")
    assert result.code == ExitCode.UNAVAILABLE
    assert result.err.startswith(f"gaitswarm: {said}")
    assert "Traceback" not in result.err


@pytest.mark.slow
def test_an_optimization_without_workers_names_the_command_to_resume(
    gaitswarm: Gaitswarm, small_spec: Path, db: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def no_cluster(*_: object, **__: object) -> None:
        raise EvaluatorUnavailable("no Ray cluster listens there")

    with monkeypatch.context() as without_workers:
        without_workers.setattr(embedded, "open_evaluator", no_cluster)
        stopped = gaitswarm("optimize", "--spec", small_spec, "--db", db)
    assert stopped.code == ExitCode.UNAVAILABLE
    said = re.search(
        r"^gaitswarm: no Ray.*\n.*to resume, run\n  gaitswarm (.*)$", stopped.err, re.MULTILINE
    )
    assert said, stopped.err
    resumed = gaitswarm(*said[1].split(), *IN_PROCESS, "--json")
    assert (resumed.code, resumed.json["state"]) == (ExitCode.OK, "succeeded")
