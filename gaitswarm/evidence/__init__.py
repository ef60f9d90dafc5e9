"""Evidence: a file that proves a run and can be checked without its database."""

from __future__ import annotations

from typing import Final

MANIFEST: Final = "manifest.json"
