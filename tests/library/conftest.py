"""One small finished job; the four ways to reach the jobs of a database."""

from __future__ import annotations

import inspect
import shutil
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, cast

import pytest
from anyio.from_thread import BlockingPortal, start_blocking_portal

import gaitswarm
from tests.examples.walks import SHORT_WALK, UPHILL_WALK

SMALL: dict[str, Any] = {
    "name": "small",
    "controller": "pi",
    "scenarios": [SHORT_WALK, UPHILL_WALK],
    "particles": 3,
    "iterations": 2,
    "seed": 7,
}
"""A job of a dozen short walks, as keywords."""


@dataclass(frozen=True, slots=True)
class Finished:
    """A database with a job that has succeeded."""

    db: Path
    result: gaitswarm.OptimizationResult

    @property
    def id(self) -> str:
        return self.result.job.id


@pytest.fixture(scope="session")
def finished_once(tmp_path_factory: pytest.TempPathFactory) -> Finished:
    db = tmp_path_factory.mktemp("finished") / "jobs.db"
    return Finished(db, gaitswarm.optimize(db=db, **SMALL))


@pytest.fixture
def finished(finished_once: Finished, tmp_path: Path) -> Finished:
    """A copy of the database, which a test may change."""
    db = tmp_path / "jobs.db"
    shutil.copy(finished_once.db, db)
    return Finished(db, finished_once.result)


@pytest.fixture(scope="session")
def many_jobs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A database with more jobs than there are on a page, which no test changes."""
    db = tmp_path_factory.mktemp("many") / "jobs.db"
    with gaitswarm.open(db) as here:
        for seed in range(103):
            here.submit(**{**SMALL, "name": str(seed)})
    return db


@pytest.fixture
def db(database: Path) -> Path:
    """A database without jobs."""
    return database.rename(database.with_name("new.db"))


@pytest.fixture
def serve(serve_database: Callable[[Path], str]) -> Callable[[Path], str]:
    """The server, made to serve a database; its URL."""
    return serve_database


class Blocking:
    """An `AsyncJobs` whose methods are called as those of `Jobs` are."""

    def __init__(self, jobs: gaitswarm.AsyncJobs, portal: BlockingPortal) -> None:
        self._jobs = jobs
        self._portal = portal

    def __getattr__(self, name: str) -> Any:
        method = getattr(self._jobs, name)
        if not callable(method):
            return method
        if inspect.iscoroutinefunction(method):
            return lambda *args, **kwargs: self._portal.call(partial(method, *args, **kwargs))
        return lambda *args, **kwargs: self._items(partial(method, *args, **kwargs))

    def _items(self, iterate: Callable[[], Any]) -> Iterator[Any]:
        items = iterate()
        end = object()

        async def following() -> Any:
            return await anext(items, end)

        while (item := self._portal.call(following)) is not end:
            yield item


@pytest.fixture(scope="session")
def portal() -> Iterator[BlockingPortal]:
    """An event loop in a thread."""
    with start_blocking_portal() as portal:
        yield portal


Reach = Callable[[Path], gaitswarm.Jobs]


_IN_DATABASES = {"test_deletion", "test_fork", "test_labels", "test_priority"}
"""Modules that `make test` runs on a database of this process too, which commands use as well."""


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Leave most tests on a database to `make test-all`."""
    here = Path(__file__).parent
    for item in items:
        if item.path.parent != here or item.path.stem in _IN_DATABASES:
            continue
        parameters = getattr(item, "callspec", None)
        if parameters is not None and parameters.params.get("reach") == "database":
            item.add_marker(pytest.mark.thorough("the same without a server"))


# Either way comes blocking and as coroutines, which are made of the same: one of each is enough for
# `make test`.
@pytest.fixture(
    params=[
        "database",
        pytest.param("server", marks=pytest.mark.thorough),
        pytest.param("async database", marks=pytest.mark.thorough),
        "async server",
    ]
)
def reach(
    request: pytest.FixtureRequest, serve: Callable[[Path], str], portal: BlockingPortal
) -> Iterator[Reach]:
    """Each way to the jobs of a database file."""
    with ExitStack() as stack:

        def jobs(db: Path) -> gaitswarm.Jobs:
            match request.param:
                case "database":
                    return stack.enter_context(gaitswarm.open(db))
                case "server":
                    return stack.enter_context(gaitswarm.connect(serve(db)))
                case "async database":
                    reached: gaitswarm.Jobs = gaitswarm.open(db)
                case _:
                    reached = gaitswarm.connect(serve(db))
            there = gaitswarm.AsyncJobs(reached)
            stack.enter_context(portal.wrap_async_context_manager(there))
            return cast(gaitswarm.Jobs, Blocking(there, portal))

        yield jobs
