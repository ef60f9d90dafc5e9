"""Paths in the repository."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).parents[2]

CHAPTER_3: Final = ROOT / "examples" / "chapter-3"
"""Folder of the job specs of chapter 3's study, one by controller."""

QUADRUPED: Final = ROOT / "examples" / "quadruped"
"""Folder of a robot that is not shipped, and of the walk `crawl.json`."""


def copy_package(folder: Path) -> Path:
    """Copy the package into a folder, its symbolic links followed, and return its new path.

    With its bytecode, which is valid there: compiling all modules takes longer than most tests.
    """
    ignored = shutil.ignore_patterns("page", "manual", "prebuilt")
    return shutil.copytree(ROOT / "gaitswarm", folder / "gaitswarm", ignore=ignored)
