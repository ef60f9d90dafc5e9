"""Jobs whose spec this version cannot read, on the command line."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest

from tests.cli.conftest import Gaitswarm

pytestmark = pytest.mark.slow

Place = Callable[[Path], list[str]]


@pytest.fixture
def unreadable(gaitswarm: Gaitswarm, small_spec: Path, db: Path) -> str:
    job_id = gaitswarm("submit", "--spec", small_spec, "--db", db).out.strip()
    with closing(sqlite3.connect(db)) as connection, connection:
        connection.execute("UPDATE jobs SET spec = json_set(spec, '$.schema_version', 99)")
    return job_id


def test_list_and_status_show_an_unreadable_job_and_others_explain(
    gaitswarm: Gaitswarm, small_spec: Path, db: Path, place: Place, unreadable: str
) -> None:
    sound = gaitswarm("submit", "--spec", small_spec, "--db", db).out.strip()
    where = place(db)
    listed = gaitswarm("list", *where)
    assert listed.code == 0, listed.err
    assert unreadable in listed.out and sound in listed.out
    status = gaitswarm("status", unreadable, *where)
    assert status.code == 0, status.err
    assert "schema_version" in status.out
    assert gaitswarm("status", unreadable, *where, "--json").json["spec"] is None
    for command in ("history", "export", "extend"):
        options = {
            "export": ("--output", str(db.with_suffix(".csv"))),
            "extend": ("--iterations", "9"),
        }
        json = ["--json"] if command == "history" else []
        refused = gaitswarm(command, unreadable, *options.get(command, ()), *where, *json)
        assert refused.code == 4, (command, refused.err)
        assert "schema_version" in refused.err and "Traceback" not in refused.err


def test_running_an_unreadable_job_sets_it_aside_with_the_reason(
    gaitswarm: Gaitswarm, db: Path, unreadable: str
) -> None:
    optimize = ("optimize", "--resume", unreadable, "--evaluator", "in-process", "--db", db)
    refused = gaitswarm(*optimize)
    assert refused.code == 4, refused.err
    assert "schema_version" in refused.err
