"""Commands run in this process; one small finished job, walked by the real simulator."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any, cast

import pytest
from fastapi import FastAPI

from api import dependencies
from api.app import create_app
from api.server import ApiServer
from cli.main import run
from gaitswarm.settings import Settings
from services.optimizer.service import JobService
from services.runtime import open_store

SHORT_WALK = {"name": "short", "cycle_time": 0.6, "radius": 0.16, "hip_height": 0.15, "cycles": 1.0}

SMALL_SPEC: dict[str, Any] = {
    "name": "small",
    "scenarios": [SHORT_WALK],
    "optimizer": {"name": "pso", "particles": 3},
    "iterations": 2,
    "seed": 7,
}

PUBLISHED_A = {
    "I": 0.171,
    "FI1R": 5837,
    "FI2R": 20111,
    "FOR": 781,
    "FOMF": 2,
    "FW1": 0.187,
    "FW23": 0.961,
    "FW4": 0.789,
    "FW56": 0.927,
}


@dataclass(frozen=True, slots=True)
class Result:
    """What a command left: exit code, stdout, stderr."""

    code: int
    out: str
    err: str

    @property
    def json(self) -> Any:
        return json.loads(self.out)


def run_command(*arguments: str | Path) -> Result:
    out, err = StringIO(), StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        code = run([str(argument) for argument in arguments])
    return Result(code, out.getvalue(), err.getvalue())


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


@pytest.fixture(scope="session")
def lasting_server() -> Iterator[tuple[str, FastAPI]]:
    """One server for all tests, its URL and its application; starting one takes longer."""
    app = create_app(cast(JobService, None), settings=Settings(api_event_poll_seconds=0.02))
    server = ApiServer(app, host="127.0.0.1", port=0, log_level="critical")
    thread = threading.Thread(target=server.run)
    thread.start()
    yield server.url, app
    server.stop()
    thread.join(timeout=10.0)
    assert not thread.is_alive()


@pytest.fixture
def serve_database(lasting_server: tuple[str, FastAPI]) -> Iterator[Callable[[Path], str]]:
    """The server, made to serve a database; its URL."""
    url, app = lasting_server
    with ExitStack() as stack:

        def serve(db: Path) -> str:
            store = stack.enter_context(closing(open_store(str(db))))
            service = JobService(store)
            app.dependency_overrides[dependencies.service] = lambda: service
            return url

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
