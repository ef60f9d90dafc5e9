"""A folder of packages with plug-ins, on the path of this process and of those that it starts."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.examples.paths import ROOT
from tests.examples.plugins import install, installed

EXAMPLE = ROOT / "examples" / "mujoco_case"


@pytest.fixture
def site(tmp_path: Path) -> Path:
    """An empty folder to install into."""
    folder = tmp_path / "site"
    folder.mkdir()
    return folder


@pytest.fixture
def mujoco_case(site: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The example, as its own pyproject.toml declares it."""
    pytest.importorskip("mujoco")
    import tomllib

    project = tomllib.loads((EXAMPLE / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    install(site, project["name"], project["entry-points"], {}, version=project["version"])
    (site / "gaitswarm_mujoco_case").symlink_to(EXAMPLE / "gaitswarm_mujoco_case")
    monkeypatch.setenv("PYTHONPATH", f"{site}{os.pathsep}{ROOT}")
    with installed(site):
        yield site
