"""Fixtures of all tests: files of the user are neither read nor written."""

from __future__ import annotations

import os
from pathlib import Path

import pytest


@pytest.fixture(autouse=True)
def user_data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Redirect the user's data, ignore the user's settings, and do not reuse simulations."""
    for name in os.environ:
        if name.startswith("GAITSWARM_"):
            monkeypatch.delenv(name)
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "user-data"))
    monkeypatch.setenv("GAITSWARM_CACHE", "0")
