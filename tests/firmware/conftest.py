"""Firmware folders, and the commands of their Makefiles."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import pytest

from gaitswarm.firmware import write_firmware
from gaitswarm.sim.controllers import CONTROLLERS, ControllerName
from tests.examples.walks import short_walk

TOOLS: Final = Path(sys.prefix) / "cross"
"""Where scripts/microcontroller.sh puts what a machine lacks."""

_COMPARED: Final = re.compile(r"^(\S+): (\d+) samples compared, (\d+) differing$", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Made:
    """What a command of a folder's Makefile left."""

    code: int
    out: str
    err: str

    @property
    def compared(self) -> list[tuple[str, int, int]]:
        """File of a walk, or `all`; samples that were compared; those that differ."""
        return [
            (name, int(n), int(differing)) for name, n, differing in _COMPARED.findall(self.out)
        ]


def make(folder: Path, target: str, *variables: str, path: str | None = None) -> Made:
    """Run a target of a folder's Makefile. path: of its tools, if not this process's."""
    environment = {**os.environ, "PATH": path or f"{os.environ['PATH']}{os.pathsep}{TOOLS}"}
    command = [shutil.which("make") or "make", "--no-print-directory", "-C", str(folder), target]
    done = subprocess.run(
        [*command, *variables],
        capture_output=True,
        text=True,
        check=False,
        env=environment,
        timeout=200,
    )
    return Made(done.returncode, done.stdout, done.stderr)


def published(controller: ControllerName, name: str) -> Mapping[str, float]:
    """A design of the literature."""
    return CONTROLLERS[controller].published[name]


@pytest.fixture(scope="session")
def published_a(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Firmware of the published optimum A in two walks; not to be changed."""
    folder = tmp_path_factory.mktemp("published-a") / "firmware"
    write_firmware(
        published("fuzzy-pi", "A"),
        folder,
        scenarios=["normal-fast", "slope-fast"],
        label="published A",
    )
    return folder


@pytest.fixture
def brief_a(tmp_path: Path) -> Path:
    """Firmware of the same design in one short walk."""
    folder = tmp_path / "firmware"
    gait = short_walk(cycle_time=0.5, stride=0.04, height=0.02)
    write_firmware(published("fuzzy-pi", "A"), folder, scenarios=gait)
    return folder


@pytest.fixture
def copy_of_a(published_a: Path, tmp_path: Path) -> Path:
    """The same, to be changed."""
    return Path(shutil.copytree(published_a, tmp_path / "firmware"))


def replaced(path: Path, old: str, new: str) -> None:
    """Change one place of a file."""
    text = path.read_text(encoding="utf-8")
    assert text.count(old) == 1, f"{text.count(old)} times {old!r} in {path}"
    path.write_text(text.replace(old, new), encoding="utf-8")


def with_changed_cell(folder: Path, cell: int, table: str = "direct") -> None:
    """Add one to a cell of a fuzzy table."""
    path = folder / "tables.c"
    head, body = path.read_text(encoding="utf-8").split(
        f"{table}_table[{table.upper()}_CELLS] = {{"
    )
    cells, tail = body.split("}", 1)
    numbers = cells.split(",")
    value = int(numbers[cell])
    numbers[cell] = str(value + (1 if value < 0 else -1))
    path.write_text(
        f"{head}{table}_table[{table.upper()}_CELLS] = {{{','.join(numbers)}}}{tail}",
        encoding="utf-8",
    )
