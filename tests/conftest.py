"""What every test may rely on: nothing of the user's own is read or written."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import settings

# Machines are noisy: how long an example takes says nothing about the code.
settings.register_profile("gaitswarm", deadline=None)
settings.load_profile("gaitswarm")


@pytest.fixture(autouse=True)
def _no_user_data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A data directory of the test's own, and none of the user's settings."""
    for name in os.environ:
        if name.startswith("GAITSWARM_"):
            monkeypatch.delenv(name)
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "user-data"))


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Leave out, of a run of the fast tests, a module that takes seconds only to be collected."""
    fast_only = config.getoption("markexpr", "") == "not slow"
    return True if fast_only and collection_path.name == "test_conformance.py" else None
