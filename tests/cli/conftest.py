"""Commands run in this process; one small finished job, walked by the real simulator."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from services.optimizer.service import JobService
from services.runtime import open_store
from tests.examples.commands import Result, run_command
from tests.examples.jobs import SMALL_SPEC
from tests.examples.servers import Server

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
def db(tmp_path: Path) -> Path:
    return tmp_path / "jobs.db"


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
    folder = tmp_path_factory.mktemp("finished")
    spec, db = folder / "spec.json", folder / "jobs.db"
    spec.write_text(json.dumps(SMALL_SPEC), encoding="utf-8")
    result = run_command(
        "optimize", "--spec", spec, "--db", db, "--evaluator", "in-process", "--json"
    )
    assert result.code == 0, result.err
    return Finished(db, result.json)


@pytest.fixture
def serve_database(lasting_server: Server) -> Iterator[Callable[[Path], str]]:
    """The server, made to serve a database; its URL."""
    with ExitStack() as stack:

        def serve(db: Path) -> str:
            store = stack.enter_context(closing(open_store(str(db))))
            lasting_server.serve(JobService(store))
            return lasting_server.url

        yield serve


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
