"""The database as a whole, on the command line."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path

from cli.exit_codes import ExitCode
from services.optimizer.store.revisions import head
from tests.cli.conftest import Gaitswarm
from tests.store.test_upgrades import OLDER, store_older


def test_commands_refuse_an_older_database_until_it_is_upgraded(
    gaitswarm: Gaitswarm, db: Path
) -> None:
    store_older(f"sqlite:///{db}")
    refused = gaitswarm("list", "--db", db)
    assert refused.code == ExitCode.UNAVAILABLE
    assert f"revision {OLDER}" in refused.err and "`gaitswarm db upgrade`" in refused.err

    upgraded = gaitswarm("db", "upgrade", "--db", db)
    assert upgraded.code == ExitCode.OK
    assert f"revision {head()} now, after {OLDER}" in upgraded.err
    assert "already" in gaitswarm("db", "upgrade", "--db", db).err
    assert len(gaitswarm("list", "--db", db, "--json").json) == 1


def test_a_database_in_use_is_not_upgraded(gaitswarm: Gaitswarm, db: Path) -> None:
    store_older(f"sqlite:///{db}")
    with closing(sqlite3.connect(db)) as other:
        other.execute("SELECT count(*) FROM jobs").fetchall()
        refused = gaitswarm("db", "upgrade", "--db", db)
    assert refused.code == ExitCode.CONFLICT and "in use" in refused.err


def test_a_database_that_is_not_there_is_not_made(gaitswarm: Gaitswarm, db: Path) -> None:
    assert gaitswarm("db", "upgrade", "--db", db).code == ExitCode.NOT_FOUND
    assert not db.exists()
