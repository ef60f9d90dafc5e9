"""The installed Chromium, with software rendering and without background traffic."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Final

SHELL: Final = "chromium-headless-shell"
"""Chromium without a user interface, which saves a fifth of the test time."""

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
    # Compositing on an emulated GPU would take a third of the time.
    "--disable-gpu-compositing",
)


def find_shell() -> Path | None:
    """Find the headless shell, or else a browser."""
    return _first_of(SHELL, *BROWSERS)


def find_browser() -> Path | None:
    """Find a regular browser, or else the headless shell."""
    return _first_of(*BROWSERS, SHELL)


def _first_of(*names: str) -> Path | None:
    """Find the first executable on the path."""
    path = next(filter(None, map(shutil.which, names)), None)
    return Path(path) if path else None
