"""Main path of the page in Firefox; `make test-firefox` installs it."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from tests.examples import requirements
from tests.examples.paths import ROOT
from tests.examples.servers import ServerProcess

pytestmark = pytest.mark.slow

MAIN_PATH = ROOT / "web" / "browsers" / "main-path.mjs"
NAMES = ("firefox-esr", "firefox")


@pytest.fixture
def firefox() -> str:
    """Path of the browser; skips the test if Firefox or its driver is missing."""
    path = next(filter(None, map(shutil.which, NAMES)), None)
    driver = ROOT / "web" / "node_modules" / "ws"
    requirements.FIREFOX.check(
        "" if path else "Firefox is not installed (Debian: apt install firefox-esr)",
        "" if shutil.which("node") else "node is not installed (Debian: apt install nodejs)",
        "" if driver.is_dir() else "the Firefox driver is not installed (make page)",
    )
    return str(path)


def test_a_job_is_submitted_replayed_and_compared_in_firefox(
    server: ServerProcess, finished_job: str, firefox: str, tmp_path: Path
) -> None:
    command = ["node", MAIN_PATH, firefox, server.url, finished_job, tmp_path]
    completed = subprocess.run(command, check=False, capture_output=True, text=True, timeout=300)
    assert completed.returncode == 0, completed.stderr
    assert len(list(tmp_path.glob("*.png"))) == 10
