"""Fixtures of every test: nothing of the user's own is read or written.

And what takes long to make, once for all tests of a process.
"""

from __future__ import annotations

import gc
import os
import shutil
from collections.abc import Callable, Generator, Iterator
from contextlib import ExitStack, closing
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import settings

from tests.examples.variants import left_out

if TYPE_CHECKING:
    from gaitswarm.services.optimizer.store import Store
    from tests.examples.servers import Server

# Machines are noisy: how long an example takes says nothing about the code.
settings.register_profile("gaitswarm", deadline=None)
settings.register_profile("quick", deadline=None, max_examples=20)
settings.load_profile("gaitswarm")


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(
    collector: pytest.Collector,
) -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    """Begin reading each folder elsewhere in every process of a test run.

    Reading a test module for the first time, with its assertions rewritten, takes longer than all
    else of it: each process finds most of them as another one has left them.
    """
    report = yield
    input_of_worker = getattr(collector.config, "workerinput", None)
    if input_of_worker and isinstance(collector, pytest.Directory):
        of_worker = int(input_of_worker["workerid"].removeprefix("gw"))
        first = len(report.result) * of_worker // input_of_worker["workercount"]
        report.result = report.result[first:] + report.result[:first]
    return report


@pytest.hookimpl(wrapper=True)
def pytest_pycollect_makeitem(
    collector: pytest.Module | pytest.Class, name: str
) -> Generator[None, Any, Any]:
    """Mark what `variants` leaves out of a test as thorough, before one is chosen by its id."""
    made = yield
    found = made if isinstance(made, list) else []
    instances = [item for item in found if isinstance(item, pytest.Function)]
    mark = instances[0].get_closest_marker("variants") if len(instances) > 1 else None
    if mark:
        by_id = {item.callspec.id: item for item in instances}
        try:
            more = left_out(by_id, *mark.args, **mark.kwargs)
        except ValueError as error:
            raise collector.CollectError(f"{name}: {error}") from None
        for each in more:
            by_id[each].add_marker("thorough")
    return made


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Put the chosen tests into the order that all processes of a test run must agree on.

    Each process is dealt as many consecutive tests, and takes the last ones of another when it has
    done. The first process begins with tests that start Ray clusters: two clusters at a time would
    wait for each other's processors until their time is out. And they wait often, while the other
    processes compute. The second one begins with tests of the page: each process that takes one of
    them starts a server, walks a job, and opens a browser.
    """
    input_of_worker = getattr(config, "workerinput", None)
    if input_of_worker:
        items.sort(key=lambda item: item.path.parts)
    items.sort(key=lambda item: item.path.parent.name != "worker")
    if input_of_worker:
        of_page = [item for item in items if item.path.parent.name == "web"]
        others = [item for item in items if item.path.parent.name != "web"]
        second = len(items) // input_of_worker["workercount"]
        items[:] = [*others[:second], *of_page, *others[second:]]


_numbers = count()


@pytest.fixture(autouse=True)
def user_data(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A data directory of the test's own, not made yet, and none of the user's settings."""
    for name in os.environ:
        if name.startswith("GAITSWARM_"):
            monkeypatch.delenv(name)
    # Not within the test's folder: most tests have no use for one, and making it takes as long.
    own = tmp_path_factory.getbasetemp() / f"user-data-{next(_numbers)}"
    monkeypatch.setenv("XDG_DATA_HOME", str(own))
    # A job that is run again, to be compared with the first, is to walk again.
    monkeypatch.setenv("GAITSWARM_CACHE", "0")
    return own


@pytest.fixture(scope="session")
def empty_database(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An SQLite file of the newest schema, to be copied: migrating one takes ten times as long."""
    from gaitswarm.services.optimizer.store import open_store

    path = tmp_path_factory.mktemp("database") / "empty.db"
    open_store(str(path)).close()
    return path


@pytest.fixture
def database(empty_database: Path, tmp_path: Path) -> Path:
    """An empty database of the test's own."""
    return Path(shutil.copy(empty_database, tmp_path / "jobs.db"))


@pytest.fixture
def store(database: Path) -> Iterator[Store]:
    """The store on `database`."""
    from gaitswarm.services.optimizer.store import open_store

    opened = open_store(str(database))
    yield opened
    opened.close()


@pytest.fixture(scope="session")
def lasting_server() -> Iterator[Server]:
    """One server in this process for most tests, which tell it whose jobs it serves.

    Starting and stopping one takes longer than they do. It notifies one host, which is nowhere.
    """
    from tests.examples.servers import Server

    server = Server(None, webhook_hosts="ci.example")
    yield server
    server.close()


@pytest.fixture
def serve_database(lasting_server: Server) -> Iterator[Callable[[Path], str]]:
    """Let the lasting server serve the jobs of a database; its URL."""
    from gaitswarm.services.optimizer.service import JobService
    from gaitswarm.services.optimizer.store import open_store

    with ExitStack() as stack:

        def serve(db: Path) -> str:
            store = stack.enter_context(closing(open_store(str(db))))
            lasting_server.serve(JobService(store))
            return lasting_server.url

        yield serve


def pytest_configure(config: pytest.Config) -> None:
    """Before anything is collected, let alone run."""
    if "not thorough" in config.getoption("markexpr", ""):
        settings.load_profile("quick")
    # What is imported and collected lasts: nothing of it is garbage.
    gc.disable()
    # Databases of tests need not survive a power cut: half of their time is waiting for the disk.
    from gaitswarm.services.optimizer.store import engine

    vars(engine)["SYNCHRONOUS"] = "OFF"
    from tests.examples.statements import share_statements

    share_statements()
    # Ray's workers run at normal priority, so that other tests do not starve them.
    os.environ.setdefault("RAY_worker_niceness", "1")


def pytest_collection_finish() -> None:
    """Garbage is looked for from now on, in what tests make: seldom, as they make little."""
    gc.freeze()
    gc.set_threshold(20_000, 20, 20)
    gc.enable()


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Leave out, of a run of the fast tests, a module that takes seconds only to be collected."""
    fast_only = "not slow" in config.getoption("markexpr", "")
    return True if fast_only and collection_path.name == "test_conformance.py" else None
