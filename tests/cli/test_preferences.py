"""`gaitswarm preferences`: searches for preferences with robust optima."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.cli.conftest import Finished, Gaitswarm
from tests.examples.preferences import DOCUMENT

pytestmark = pytest.mark.slow


def test_a_search_of_a_job_is_submitted_and_shows_what_each_preference_buys(
    gaitswarm: Gaitswarm, finished: Finished, tmp_path: Path
) -> None:
    db = tmp_path / "jobs.db"
    spec = tmp_path / "preferences.json"
    spec.write_text(json.dumps(DOCUMENT | {"tuning": DOCUMENT["tuning"] | {"iterations": 1}}))
    ended = gaitswarm("optimize", "--spec", spec, "--db", db, "--json")
    assert ended.code == 0, ended.err
    shown = gaitswarm("preferences", ended.json["id"], "--db", db)
    assert shown.code == 0, shown.err
    assert "reference" in shown.out
    assert "recommended: {" in shown.out
    candidates = gaitswarm("preferences", ended.json["id"], "--db", db, "--json").json["candidates"]
    assert {c["named"] for c in candidates} == {"A", "B", "C", None}

    submitted = gaitswarm("preferences", finished.id, "--search", "--db", finished.db, "--json")
    assert submitted.code == 0, submitted.err
    job = submitted.json
    assert (job["kind"], job["state"]) == ("preferences", "queued")
    best = gaitswarm("best", finished.id, "--db", finished.db, "--json").json["design"]
    assert job["spec"]["tuning"]["start"][0] == best
