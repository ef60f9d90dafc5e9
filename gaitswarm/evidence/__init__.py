"""Evidence: a file that proves a run and can be checked without its database."""

from __future__ import annotations

from typing import Final

FORMAT: Final = "gaitswarm-evidence"

VERSION: Final = 1
"""Version of the layout; other versions are refused."""

MANIFEST: Final = "manifest.json"
