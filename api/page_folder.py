"""Where the built page lies, and whether it does."""

from __future__ import annotations

from pathlib import Path
from typing import Final

FOLDER: Final = Path(__file__).parent / "page"
"""`make page` builds it from web/; a wheel brings it."""


def is_built(folder: Path = FOLDER) -> bool:
    """Is there a page to serve?"""
    return (folder / "index.html").is_file()
