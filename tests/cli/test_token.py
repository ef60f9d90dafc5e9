"""Tokens on the command line, and a server that requires them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from gaitswarm.cli.exit_codes import ExitCode
from tests.cli.conftest import Gaitswarm
from tests.examples.forked import ForkedCommand
from tests.examples.processes import line_with


def test_a_token_is_made_listed_and_revoked(gaitswarm: Gaitswarm, new_db: Path) -> None:
    made = gaitswarm("token", "create", "ci", "--scope", "read", "--db", new_db)
    assert made.code == ExitCode.OK
    assert made.out.startswith("gaitswarm_") and "shown only once" in made.err

    (listed,) = gaitswarm("token", "list", "--db", new_db, "--json").json
    assert (listed["name"], listed["scope"], listed["revoked_at"]) == ("ci", "read", None)
    assert made.out.strip() not in json.dumps(listed)

    assert gaitswarm("token", "revoke", "ci", "--db", new_db).code == ExitCode.OK
    assert "revoked" in gaitswarm("token", "list", "--db", new_db).out


def test_looking_for_tokens_makes_no_database(gaitswarm: Gaitswarm, new_db: Path) -> None:
    for arguments in (("list",), ("revoke", "ci")):
        result = gaitswarm("token", *arguments, "--db", new_db)
        assert result.code == ExitCode.NOT_FOUND and "there is no database" in result.err
    assert not new_db.exists()


def test_only_secrets_and_one_line_per_token_are_printed(
    gaitswarm: Gaitswarm, new_db: Path
) -> None:
    secrets = [gaitswarm("token", "create", name, "--db", new_db).out for name in ("a", "b")]
    assert [secret.count("\n") for secret in secrets] == [1, 1]
    assert len(gaitswarm("token", "list", "--db", new_db).out.splitlines()) == 2


def test_tokens_that_cannot_be_created_or_revoked_are_named(
    gaitswarm: Gaitswarm, new_db: Path
) -> None:
    gaitswarm("token", "create", "ci", "--db", new_db)
    again = gaitswarm("token", "create", "ci", "--db", new_db)
    assert again.code == ExitCode.BAD_INPUT and "'ci' already" in again.err
    unknown = gaitswarm("token", "revoke", "unknown", "--db", new_db)
    assert unknown.code == ExitCode.NOT_FOUND and "'unknown'" in unknown.err


def test_beyond_this_machine_the_first_start_prints_a_token(
    gaitswarm: Gaitswarm, new_db: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    options = ("--db", str(new_db), "--host", "0.0.0.0", "--port", "0", "--no-runner")  # noqa: S104
    process = ForkedCommand("serve", *options, stdout=None)
    try:
        port = line_with(process.stderr, r"serves http://0\.0\.0\.0:(\d+) and")[1]
        secret = line_with(process.stderr, r"^\s*(gaitswarm_\S+)$")[1]
        server = f"http://127.0.0.1:{port}"
        refused = gaitswarm("list", "--server", server)
        assert refused.code == ExitCode.FORBIDDEN and "GAITSWARM_TOKEN" in refused.err
        monkeypatch.setenv("GAITSWARM_TOKEN", secret)
        allowed = gaitswarm("list", "--server", server, "--json")
        assert allowed.code == ExitCode.OK, allowed.err
        assert allowed.json == []
    finally:
        process.terminate()
        process.communicate(timeout=30.0)
