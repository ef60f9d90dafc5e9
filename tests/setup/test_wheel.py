"""The installed package: one top-level folder, whatever else is on the path."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from tests.examples.paths import ROOT

NAMESAKES = ("sim", "services", "api", "cli", "worker", "tests")
"""Modules that a user's folder, or a ROS workspace, may have."""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A wheel built from a copy of the checkout, with its symbolic links."""
    folder = tmp_path_factory.mktemp("wheel")
    ignored = shutil.ignore_patterns("__pycache__", "prebuilt", "page", "manual")
    for name in ("gaitswarm", "sim", "services", "api", "cli"):
        shutil.copytree(ROOT / name, folder / "source" / name, symlinks=True, ignore=ignored)
    for name in ("pyproject.toml", "README.md"):
        shutil.copy(ROOT / name, folder / "source")
    build = ["-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation"]
    command = [sys.executable, *build, "--wheel-dir", str(folder), str(folder / "source")]
    subprocess.run(command, check=True)
    (built,) = folder.glob("*.whl")
    return built


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder into which the wheel is installed."""
    folder = tmp_path_factory.mktemp("installed")
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index"]
    subprocess.run([*command, "--target", str(folder), str(wheel)], check=True)
    return folder


@pytest.fixture
def crowded(tmp_path: Path) -> Path:
    """A user's folder whose modules and packages have the names of our folders."""
    for name in NAMESAKES[:3]:
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text("raise ImportError('the wrong one')\n")
    for name in NAMESAKES[3:]:
        (tmp_path / f"{name}.py").write_text("raise ImportError('the wrong one')\n")
    return tmp_path


def run_in(folder: Path, installed: Path, *command: str) -> subprocess.CompletedProcess[str]:
    path = os.pathsep.join([str(folder), str(installed)])
    return subprocess.run(
        [sys.executable, *command],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )


@pytest.mark.slow
def test_the_wheel_has_one_top_level_package(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    packages = {name.partition("/")[0] for name in names if ".dist-info/" not in name}
    assert packages == {"gaitswarm"}
    for expected in ("sim/simulate.py", "services/runtime.py", "api/app.py", "cli/main.py"):
        assert f"gaitswarm/{expected}" in names


@pytest.mark.slow
def test_library_and_command_work_next_to_modules_of_the_same_names(
    installed: Path, crowded: Path
) -> None:
    program = "import gaitswarm; print(gaitswarm.__file__); print(*gaitswarm.SCENARIOS)"
    imported = run_in(crowded, installed, "-c", program)
    assert imported.returncode == 0, imported.stderr
    assert imported.stdout.startswith(str(installed))
    assert "normal-fast" in imported.stdout

    simulated = run_in(
        crowded, installed, "-m", "gaitswarm", "simulate", "--design", "published:A", "--json"
    )
    assert simulated.returncode == 0, simulated.stderr
    assert '"objectives"' in simulated.stdout

    script = installed / "bin" / "gaitswarm"
    version = run_in(crowded, installed, str(script), "--version")
    assert version.returncode == 0, version.stderr
