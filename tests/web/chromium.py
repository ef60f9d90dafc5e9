"""The machine's own Chromium, quiet and drawing in software."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Final

SHELL: Final = "chromium-headless-shell"
"""Chromium's engine without the windows around it, which take a fifth of what the tests take."""

BROWSERS: Final = ("chromium", "chromium-browser", "google-chrome")

ARGUMENTS: Final = (
    "--no-sandbox",
    "--disable-gpu-sandbox",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    # On an emulated graphics card, to put a page together is a third of what it takes.
    "--disable-gpu-compositing",
)


def find_shell() -> Path | None:
    """The headless shell, or a browser where there is none."""
    return _first_of(SHELL, *BROWSERS)


def find_browser() -> Path | None:
    """The one that people use, or the headless shell where there is none."""
    return _first_of(*BROWSERS, SHELL)


def _first_of(*names: str) -> Path | None:
    """The first that is on the path."""
    found = next(filter(None, map(shutil.which, names)), None)
    return Path(found) if found else None
