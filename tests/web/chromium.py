"""The machine's own Chromium, quiet and drawing in software."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Final

NAMES: Final = ("chromium", "chromium-browser", "google-chrome")

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


def find_chromium() -> Path | None:
    """The first that is on the path."""
    found = next(filter(None, map(shutil.which, NAMES)), None)
    return Path(found) if found else None
