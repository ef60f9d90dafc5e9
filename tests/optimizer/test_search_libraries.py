"""Libraries that search methods use: refused where missing, and part of a job's provenance."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from importlib import metadata

import pytest

from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.provenance import job_provenance
from gaitswarm.services.optimizer.search.registry import METHODS, OPTIMIZERS
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store import Store
from tests.optimizer.formula import SPEC

OPTIONAL = ("pymoo", "PyNomad", "scipy.stats")
"""Modules that take long to import, or may be missing."""


def test_a_job_whose_search_needs_a_missing_library_is_refused_with_the_way_out(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    method = replace(METHODS["random"], libraries=("no-such-distribution",))
    monkeypatch.setitem(METHODS, "random", method)
    spec = SPEC.model_copy(update={"optimizer": OPTIMIZERS["random"]})
    with pytest.raises(InvalidRequest, match=r"pip install no-such-distribution") as refused:
        JobService(store).submit(spec)
    assert refused.value.field == "optimizer"
    assert "no-such-distribution" in str(refused.value)
    JobService(store).submit(SPEC)


def test_a_job_keeps_the_versions_of_the_libraries_of_its_search() -> None:
    spec = SPEC.model_copy(update={"optimizer": OPTIMIZERS["de"]})
    kept = job_provenance(spec)
    assert kept.search_libraries == {"scipy": metadata.version("scipy")}
    other = kept.model_copy(update={"search_libraries": {"scipy": "0.1"}})
    assert kept.changes(other) == (f"scipy 0.1 instead of {kept.search_libraries['scipy']}",)
    assert kept.changes(kept) == ()


def test_no_method_imports_its_library_before_it_runs() -> None:
    code = (
        "import sys, gaitswarm.services.optimizer.search.registry;"
        f"print([name for name in {OPTIONAL} if name in sys.modules])"
    )
    printed = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout
    assert printed.strip() == "[]"
