"""The example package with a case in MuJoCo: installed, tested and used in a job."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from tests.examples.commands import Result, run_command
from tests.examples.forked import run_forked
from tests.plugins.conftest import EXAMPLE

pytestmark = pytest.mark.slow

CASE = {"name": "mujoco-walk", "rate": 1000}
SPEC = {
    "controller": "p",
    "scenarios": [
        {"name": "brief", "cycle_time": 0.9, "cycles": 1, "radius": 0.16, "hip_height": 0.15}
    ],
    "case": CASE,
    "optimizer": {"name": "random", "particles": 2},
    "iterations": 2,
}


def said(done: Result) -> Any:
    """What a command printed as JSON."""
    assert done.code == 0, done.err
    return json.loads(done.out)


def gaitswarm(*arguments: object) -> Any:
    """What a command of this process prints as JSON."""
    return said(run_command(*arguments, "--json"))


def process(*arguments: str | Path) -> Result:
    """A command in a process of its own, which imports the package as it is now."""
    done = run_forked(*arguments)
    return Result(done.returncode, done.stdout, done.stderr)


def run(db: Path, *options: object) -> Any:
    return gaitswarm("optimize", "--db", db, "--evaluator", "in-process", *options)


@pytest.mark.thorough("test_a_job_of_it_is_resumed_to_the_same_bits")
def test_it_keeps_to_the_contract_of_cases(mujoco_case: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--rootdir", EXAMPLE,
         EXAMPLE / "tests"],
        capture_output=True,
        text=True,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout
    assert " passed" in done.stdout and "skipped" not in done.stdout


def test_it_is_listed_with_its_distribution_and_the_schema_of_its_settings(
    mujoco_case: Path,
) -> None:
    listed = gaitswarm("plugins")
    (own,) = (one for one in listed if one["distribution"] != "gaitswarm-research")
    assert own == {
        "kind": "case",
        "name": "mujoco-walk",
        "distribution": "gaitswarm-mujoco-case",
        "version": "0.1.0",
        "state": "ok",
        "reason": None,
    }
    (case,) = gaitswarm("cases")
    assert case["settings_schema"]["properties"]["rate"]["default"] == 5000


def test_a_job_of_it_is_resumed_to_the_same_bits(mujoco_case: Path, tmp_path: Path) -> None:
    spec = tmp_path / "spec.json"
    spec.write_text(json.dumps(SPEC))
    whole = run(tmp_path / "whole.db", "--spec", spec)
    assert whole["spec"]["case"] == {**CASE, "contacts": True}
    libraries = whole["provenance"][0]["provenance"]["simulation"]["libraries"]
    assert libraries["gaitswarm-mujoco-case"].startswith("0.1.0 (code ")
    assert "mujoco-core" in libraries

    begun = run(tmp_path / "half.db", "--spec", spec, "--iterations", 1)
    job_id = begun["id"]
    gaitswarm("extend", job_id, "--db", tmp_path / "half.db", "--iterations", 2)
    resumed = run(tmp_path / "half.db", "--resume", job_id)
    assert resumed["best"] == whole["best"]

    refused = run_command("preferences", job_id, "--search", "--db", tmp_path / "half.db")
    assert refused.code == 2
    assert "case: worlds need gaitswarm's simulator" in refused.err


def test_with_other_code_of_the_plug_in_or_without_it_a_job_does_not_go_on(
    mujoco_case: Path, tmp_path: Path
) -> None:
    db, spec = tmp_path / "jobs.db", tmp_path / "spec.json"
    spec.write_text(json.dumps(SPEC | {"name": "in MuJoCo"}))
    job_id = run(db, "--spec", spec, "--iterations", 1)["id"]
    package = mujoco_case / "gaitswarm_mujoco_case"
    with without(mujoco_case):
        (listed,) = said(process("list", "--db", db, "--json"))
        assert (listed["id"], listed["name"]) == (job_id, "in MuJoCo")
        assert listed["state"] == "succeeded"
        error = said(process("status", job_id, "--db", db, "--json"))["error"]
        assert "unknown case 'mujoco-walk'" in error

    gaitswarm("extend", job_id, "--db", db, "--iterations", 2)
    package.unlink()
    shutil.copytree(EXAMPLE / "gaitswarm_mujoco_case", package)
    with (package / "case.py").open("a") as file:
        file.write("# edited\n")
    refused = process("optimize", "--db", db, "--resume", job_id)
    assert refused.code == 4, refused.err
    assert "gaitswarm-mujoco-case 0.1.0 (code " in refused.err


@contextmanager
def without(site: Path) -> Iterator[None]:
    """Processes started meanwhile cannot import packages of the folder."""
    sys.path.remove(str(site))
    yield
    sys.path.insert(0, str(site))
