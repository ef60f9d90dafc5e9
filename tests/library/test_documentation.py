"""docs/library.md tells all of the library."""

from __future__ import annotations

import inspect
import re

import gaitswarm
from tests.examples.paths import ROOT


def test_every_method_of_jobs_and_every_error_is_on_the_page() -> None:
    text = (ROOT / "docs" / "library.md").read_text(encoding="utf-8")
    written = set(re.findall(r"`(?:gaitswarm\.)?(\w+)`", text))
    methods = {name for name, _ in inspect.getmembers(gaitswarm.Jobs, inspect.isfunction)}
    public = {name for name in methods if not name.startswith("_")}
    assert public - {"close", "command"} - written == set()
    errors = {
        name
        for name in gaitswarm.__all__
        if isinstance(getattr(gaitswarm, name), type)
        and issubclass(getattr(gaitswarm, name), BaseException)
    }
    assert errors - {"LeaseLost"} - written == set()
