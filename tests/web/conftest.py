"""A real browser before a real server: processes, contexts, and what every visit must keep to."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import sync_playwright

from gaitswarm.api.page import FOLDER, is_built
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store.sql_store import SqlStore
from tests.examples import requirements
from tests.examples.jobs import SMALL_SPEC
from tests.examples.servers import QUICK_EVENTS, Server, ServerProcess
from tests.examples.walks import SHORT_WALK
from tests.web.chromium import ARGUMENTS, SHELL, find_shell
from tests.web.pages import Pages
from tests.web.visit import Visit

# Read here: the tests themselves see none of the user's settings.
SCREENSHOTS = os.environ.get("GAITSWARM_SCREENSHOTS", "")

HERE = Path(__file__).parent

SMALL_JOB: dict[str, Any] = SMALL_SPEC | {
    "scenarios": [SHORT_WALK, SHORT_WALK | {"name": "loaded", "load": 5.0}],
    "optimizer": {"name": "pso", "particles": 8},
    "iterations": 6,
    "seed": 5,
}
"""Walked to its end within seconds."""


@pytest.fixture(scope="session")
def _chromium() -> str:
    """Path of the browser; skips all tests of the page where browser or page are missing."""
    found = find_shell()
    requirements.PAGE.check(
        "" if found else f"Chromium is not installed (Debian: apt install {SHELL})",
        "" if is_built() else "the page is not built (make page)",
    )
    return str(found)


_opened = ExitStack()
"""Closes the browser, if one is open."""


@pytest.fixture(scope="session")
def _open_browser(_chromium: str) -> Iterator[Callable[[], Pages]]:
    """Start a browser, or go on with the one that is open; its pages."""
    opened: list[Pages] = []

    def pages() -> Pages:
        if not opened:
            playwright = _opened.enter_context(sync_playwright())
            browser = playwright.chromium.launch(executable_path=_chromium, args=ARGUMENTS)
            opened.append(Pages(browser))
            _opened.callback(opened.clear)
            _opened.callback(browser.close)
        return opened[0]

    yield pages
    _opened.close()


@pytest.fixture
def pages(_open_browser: Callable[[], Pages]) -> Pages:
    """Of one browser for all tests of this folder that follow each other."""
    return _open_browser()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_teardown(nextitem: pytest.Item | None) -> Iterator[None]:
    """After a test of this folder: close the browser before one of another folder begins.

    Its event loop must not outlast them, other tests run loops of their own.
    """
    try:
        yield
    finally:
        if nextitem is None or HERE not in nextitem.path.parents:
            _opened.close()


@pytest.fixture(scope="session")
def robots(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of robots whose meshes the server gives out."""
    return tmp_path_factory.mktemp("robots")


@pytest.fixture(scope="session")
def server(
    tmp_path_factory: pytest.TempPathFactory, robots: Path, _chromium: str
) -> Iterator[ServerProcess]:
    """`gaitswarm serve` with a runner, on a database of its own."""
    folder = tmp_path_factory.mktemp("server")
    environment = {**QUICK_EVENTS, "GAITSWARM_ROBOTS": str(robots)}
    server = ServerProcess(folder / "jobs.db", environment=environment)
    yield server
    server.close()


@pytest.fixture(scope="session")
def finished_job(server: ServerProcess) -> str:
    """A job that the server has walked to its end, whatever other tests have run before."""
    # Designs of another job that is the same would not walk again.
    job_id = server.submit(SMALL_JOB | {"seed": 7})
    server.wait_for(job_id, "succeeded")
    return job_id


@pytest.fixture(scope="session")
def idle_server(_chromium: str) -> Iterator[Server]:
    """One server for most tests of `start_server`, which tell it whose jobs it serves."""
    server = Server(None, page_folder=FOLDER)
    yield server
    server.close()


@pytest.fixture
def start_server(
    store: SqlStore, idle_server: Server, _chromium: str
) -> Iterator[Callable[..., Server]]:
    """For a server that has no jobs but the test's own, and runs none.

    settings: of `Server`; with any it is one of the test's own. To be asked for before `visit`,
    which ends first then.
    """
    with ExitStack() as stack:

        def start(**settings: Any) -> Server:
            if not settings:
                idle_server.serve(JobService(store))
                return idle_server
            server = Server(JobService(store), page_folder=FOLDER, **settings)
            stack.callback(server.close)
            return server

        yield start


@pytest.fixture
def visit(pages: Pages) -> Iterator[Callable[..., Visit]]:
    """Open the page of a server; at the end nothing may have gone wrong in the browser."""
    with ExitStack() as stack:

        def start(url: str, **options: Any) -> Visit:
            return stack.enter_context(Visit(pages, url, **options))

        yield start
