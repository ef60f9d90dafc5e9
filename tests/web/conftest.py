"""Fixtures for tests of the page in a real browser against a real server."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import sync_playwright

from gaitswarm.api.page import PAGE_FOLDER, is_built
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store import Store
from tests.examples import requirements
from tests.examples.jobs import SMALL_SPEC
from tests.examples.servers import QUICK_EVENTS, Server, ServerProcess
from tests.examples.walks import SHORT_WALK
from tests.web.chromium import ARGUMENTS, SHELL, find_shell
from tests.web.pages import Pages
from tests.web.visit import Visit

# Read at import: tests do not see the user's environment.
SCREENSHOTS = os.environ.get("GAITSWARM_SCREENSHOTS", "")

HERE = Path(__file__).parent

SMALL_JOB: dict[str, Any] = SMALL_SPEC | {
    "scenarios": [SHORT_WALK, SHORT_WALK | {"name": "loaded", "load": 5.0}],
    "optimizer": {"name": "pso", "particles": 8},
    "iterations": 6,
    "seed": 5,
}
"""Finishes within seconds."""


@pytest.fixture(scope="session")
def _chromium() -> str:
    """Path of the browser; skips the tests if browser or page are missing."""
    shell = find_shell()
    requirements.PAGE.check(
        "" if shell else f"Chromium is not installed (Debian: apt install {SHELL})",
        "" if is_built() else "the page is not built (make page)",
    )
    return str(shell)


_opened = ExitStack()
"""Closes the open browser."""


@pytest.fixture(scope="session")
def _open_browser(_chromium: str) -> Iterator[Callable[[], Pages]]:
    """Pages of the open browser, which is started if necessary."""
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
    """Pages of a browser shared by consecutive tests of this folder."""
    return _open_browser()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_teardown(nextitem: pytest.Item | None) -> Iterator[None]:
    """Close the browser before tests of other folders, which run their own event loops."""
    try:
        yield
    finally:
        if nextitem is None or HERE not in nextitem.path.parents:
            _opened.close()


@pytest.fixture(scope="session")
def robots(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of robots whose meshes are served."""
    return tmp_path_factory.mktemp("robots")


@pytest.fixture(scope="session")
def server(
    tmp_path_factory: pytest.TempPathFactory, robots: Path, _chromium: str
) -> Iterator[ServerProcess]:
    """`gaitswarm serve` with a runner and a separate database."""
    folder = tmp_path_factory.mktemp("server")
    environment = {**QUICK_EVENTS, "GAITSWARM_ROBOTS": str(robots)}
    server = ServerProcess(folder / "jobs.db", environment=environment)
    yield server
    server.close()


@pytest.fixture(scope="session")
def finished_job(server: ServerProcess) -> str:
    """A finished job, independent of other tests."""
    return _finished(server, seed=7)


@pytest.fixture(scope="session")
def other_job(server: ServerProcess) -> str:
    """Another finished job."""
    return _finished(server, seed=8)


def _finished(server: ServerProcess, seed: int) -> str:
    # The evaluations of an identical job would be reused.
    job_id = server.submit(SMALL_JOB | {"seed": seed})
    server.wait_for(job_id, "succeeded")
    return job_id


@pytest.fixture(scope="session")
def idle_server(_chromium: str) -> Iterator[Server]:
    """A server shared by the tests of `start_server`, each with its own store."""
    server = Server(None, page_folder=PAGE_FOLDER)
    yield server
    server.close()


@pytest.fixture
def start_server(
    store: Store, idle_server: Server, _chromium: str
) -> Iterator[Callable[..., Server]]:
    """Start a server for the test's store, without a runner.

    settings: of `Server`; with any, a separate server is started. Request this fixture before
    `visit`, which must be torn down first.
    """
    with ExitStack() as stack:

        def start(**settings: Any) -> Server:
            if not settings:
                idle_server.serve(JobService(store))
                return idle_server
            server = Server(JobService(store), page_folder=PAGE_FOLDER, **settings)
            stack.callback(server.close)
            return server

        yield start


@pytest.fixture
def visit(pages: Pages) -> Iterator[Callable[..., Visit]]:
    """Visit the page of a server; the test fails on errors in the browser."""
    with ExitStack() as stack:

        def start(url: str, **options: Any) -> Visit:
            return stack.enter_context(Visit(pages, url, **options))

        yield start
