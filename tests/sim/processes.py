"""Python in a separate process, which may die or lack modules."""

from __future__ import annotations

import subprocess

from tests.examples.paths import ROOT
from tests.examples.processes import python

__all__ = ["ROOT", "run_python"]


def run_python(
    code: str, timeout: float = 120.0, /, **environment: str
) -> subprocess.CompletedProcess[str]:
    """Statements, with all warnings shown."""
    return python("-P", "-W", "default", "-c", code, environment=environment, timeout=timeout)
