"""The page's main path in Firefox, where it is installed; `make test-firefox` installs it."""

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
    """Path of the browser; skips its tests where it, or what drives it, is missing."""
    found = next(filter(None, map(shutil.which, NAMES)), None)
    driver = ROOT / "web" / "node_modules" / "ws"
    requirements.FIREFOX.check(
        "" if found else "Firefox is not installed (Debian: apt install firefox-esr)",
        "" if shutil.which("node") else "node is not installed (Debian: apt install nodejs)",
        "" if driver.is_dir() else "what drives Firefox is not installed (make page)",
    )
    return str(found)


def test_a_job_is_submitted_followed_walked_and_compared_in_firefox(
    server: ServerProcess, finished_job: str, firefox: str, tmp_path: Path
) -> None:
    command = ["node", MAIN_PATH, firefox, server.url, finished_job, tmp_path]
    done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert len(list(tmp_path.glob("*.png"))) == 10
