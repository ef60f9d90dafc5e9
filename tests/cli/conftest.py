"""Commands run in this process; one small finished job, walked by the real simulator."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from tests.examples.commands import Result, run_command
from tests.examples.jobs import SMALL_SPEC

Gaitswarm = Callable[..., Result]
WriteJson = Callable[..., Path]


@pytest.fixture
def gaitswarm() -> Gaitswarm:
    return run_command


@pytest.fixture
def write_json(tmp_path: Path) -> WriteJson:
    def write(value: Any, name: str = "input.json") -> Path:
        path = tmp_path / name
        path.write_text(json.dumps(value), encoding="utf-8")
        return path

    return write


@pytest.fixture
def db(database: Path) -> Path:
    """An empty database."""
    return database


@pytest.fixture
def new_db(tmp_path: Path) -> Path:
    """The path of a database that a command may create."""
    return tmp_path / "new.db"


@pytest.fixture
def small_spec(write_json: WriteJson) -> Path:
    return write_json(SMALL_SPEC, "spec.json")


@dataclass(frozen=True, slots=True)
class Finished:
    """A job that was run to its end, and the database that it is in."""

    db: Path
    job: Any

    @property
    def id(self) -> str:
        return str(self.job["id"])


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Finished:
    """A job that other tests read as well, and add others to its database."""
    return finish(tmp_path_factory.mktemp("finished"))


def finish(folder: Path) -> Finished:
    spec, db = folder / "spec.json", folder / "jobs.db"
    spec.write_text(json.dumps(SMALL_SPEC), encoding="utf-8")
    result = run_command(
        "optimize", "--spec", spec, "--db", db, "--evaluator", "in-process", "--json"
    )
    assert result.code == 0, result.err
    return Finished(db, result.json)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Leave most tests on a server to `make test-all`."""
    here = Path(__file__).parent
    for item in items:
        if item.path.parent != here or item.path.stem == "test_job_commands":
            continue
        parameters = getattr(item, "callspec", None)
        if parameters is not None and parameters.params.get("place") == "server":
            item.add_marker(pytest.mark.thorough("the same over HTTP"))


@pytest.fixture(params=["database", "server"])
def place(
    request: pytest.FixtureRequest, serve_database: Callable[[Path], str]
) -> Callable[[Path], list[str]]:
    """Options by which a command reaches the jobs of a database: itself, or over HTTP."""

    def options(db: Path) -> list[str]:
        if request.param == "database":
            return ["--db", str(db)]
        return ["--server", serve_database(db)]

    return options
