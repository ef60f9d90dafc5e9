"""Requirements of tests that a machine may lack: skipped there, or failing where required."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Final

import pytest


@dataclass(slots=True)
class Requirement:
    """Of the tests of something.

    of: what the tests are of, as a failure says it. must_run: whether they fail for want of
    something, in place of being skipped, as in continuous integration.
    """

    of: str
    must_run: bool

    def check(self, *missing: str) -> None:
        """End the test if something is missing, by a skip or a failure that says what."""
        said = " and ".join(filter(None, missing))
        if said and self.must_run:
            pytest.fail(f"the tests of {self.of} must run here, but {said}")
        if said:
            pytest.skip(f"NOT TESTED HERE: {self.of}, since {said}")


def _requirement(name: str, of: str) -> Requirement:
    # Read at import: the tests themselves see none of the user's settings.
    return Requirement(of, bool(os.environ.get(f"GAITSWARM_REQUIRE_{name}")))


PAGE: Final = _requirement("PAGE", "the page")
FIREFOX: Final = _requirement("FIREFOX", "the page in Firefox")
POSTGRES: Final = _requirement("POSTGRES", "PostgreSQL")
ROBOTS: Final = _requirement("ROBOTS", "known robots")
