"""The audit log on the command line."""

from __future__ import annotations

from pathlib import Path

from gaitswarm.cli.exit_codes import ExitCode
from tests.cli.conftest import Gaitswarm


def test_audit_lists_actions_by_job(gaitswarm: Gaitswarm, db: Path) -> None:
    assert "no entries yet" in gaitswarm("audit", "--db", db).err
    first = gaitswarm("submit", "--iterations", "2", "--db", db).out.strip()
    gaitswarm("submit", "--iterations", "2", "--db", db)
    gaitswarm("extend", first, "--iterations", "7", "--db", db)
    shown = gaitswarm("audit", "--job", first, "--db", db)
    assert shown.code == ExitCode.OK
    newest, oldest = shown.out.splitlines()
    assert newest.split()[2:] == ["local", "extend", first, "iterations=7"]
    assert oldest.split()[2:] == ["local", "submit", first]
    everything = gaitswarm("audit", "--db", db, "--json").json
    assert [entry["action"] for entry in everything] == ["extend", "submit", "submit"]
    assert len(gaitswarm("audit", "--limit", "1", "--db", db, "--json").json) == 1
