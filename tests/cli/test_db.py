"""The database as a whole, on the command line."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path

from gaitswarm.cli.exit_codes import ExitCode
from gaitswarm.services.optimizer.jobs.job import Command
from gaitswarm.services.optimizer.store import open_store
from gaitswarm.services.optimizer.store.schema import head
from tests.cli.conftest import Finished, Gaitswarm
from tests.store.examples import spec
from tests.store.test_opening import edit


def test_an_upgrade_leaves_a_database_of_the_newest_schema_alone(
    gaitswarm: Gaitswarm, db: Path
) -> None:
    open_store(str(db)).close()
    upgraded = gaitswarm("db", "upgrade", "--db", db)
    assert upgraded.code == ExitCode.OK
    assert f"up to date, revision {head()}" in upgraded.err


def test_commands_refuse_a_database_of_another_schema(gaitswarm: Gaitswarm, db: Path) -> None:
    open_store(str(db)).close()
    edit(f"sqlite:///{db}", "UPDATE alembic_version SET version_num = '0019'")
    for command in (("list",), ("db", "upgrade")):
        refused = gaitswarm(*command, "--db", db)
        assert refused.code == ExitCode.UNAVAILABLE
        assert "revision 0019, which this gaitswarm" in refused.err


def test_a_missing_database_is_not_created(gaitswarm: Gaitswarm, new_db: Path) -> None:
    assert gaitswarm("db", "upgrade", "--db", new_db).code == ExitCode.NOT_FOUND
    assert not new_db.exists()


def test_a_backup_is_made_and_restored_and_overwrites_only_by_force(
    gaitswarm: Gaitswarm, finished: Finished, new_db: Path, tmp_path: Path
) -> None:
    file = tmp_path / "backup.db"
    assert gaitswarm("db", "backup", file, "--db", finished.db).code == ExitCode.OK
    again = gaitswarm("db", "backup", file, "--db", finished.db)
    assert again.code == ExitCode.CONFLICT and "--force" in again.err
    assert gaitswarm("db", "backup", file, "--force", "--db", finished.db).code == ExitCode.OK

    assert gaitswarm("db", "restore", file, "--db", new_db).code == ExitCode.OK
    assert gaitswarm("best", finished.id, "--db", new_db, "--json").json
    again = gaitswarm("db", "restore", file, "--db", new_db)
    assert again.code == ExitCode.CONFLICT and "--force" in again.err
    assert gaitswarm("db", "restore", file, "--force", "--db", new_db).code == ExitCode.OK


def test_a_check_reports_findings_and_fails(gaitswarm: Gaitswarm, db: Path) -> None:
    open_store(str(db)).close()
    sound = gaitswarm("db", "check", "--db", db, "--json")
    assert (sound.code, sound.json) == (ExitCode.OK, [])
    store_job_without_iterations(db)
    broken = gaitswarm("db", "check", "--db", db, "--json")
    assert broken.code == ExitCode.JOB_FAILED
    assert any("iteration 0: it is missing" in finding for finding in broken.json)


def store_job_without_iterations(db: Path) -> None:
    with closing(open_store(str(db))) as store:
        store.create_job(spec())
    edit(f"sqlite:///{db}", "UPDATE jobs SET iterations = 3")


def test_pruning_deletes_jobs_only_by_their_age(gaitswarm: Gaitswarm, db: Path) -> None:
    with closing(open_store(str(db))) as store:
        store.command(store.create_job(spec())[0].id, Command.CANCEL)
    refused = gaitswarm("db", "prune", "--state", "cancelled", "--db", db)
    assert refused.code == ExitCode.BAD_INPUT and "--older-than" in refused.err
    assert "0 jobs" in gaitswarm("db", "prune", "--older-than", "1", "--db", db).err
    assert "1 jobs" in gaitswarm("db", "prune", "--older-than", "0", "--db", db).err


def test_pruning_removes_entries_of_the_audit_log_only_by_their_age(
    gaitswarm: Gaitswarm, db: Path
) -> None:
    with closing(open_store(str(db))) as store:
        store.create_job(spec())
    assert "audit" not in gaitswarm("db", "prune", "--db", db).err
    day = gaitswarm("db", "prune", "--audit-older-than", "1", "--db", db)
    assert "0 audit entries" in day.err
    assert len(gaitswarm("audit", "--db", db, "--json").json) == 1
    all_of_it = gaitswarm("db", "prune", "--audit-older-than", "0", "--db", db)
    assert "1 audit entries" in all_of_it.err
    assert gaitswarm("audit", "--db", db, "--json").json == []


def test_pruning_reports_removed_entries(gaitswarm: Gaitswarm, finished: Finished) -> None:
    pruned = gaitswarm("db", "prune", "--db", finished.db)
    assert pruned.code == ExitCode.OK and "0 recordings" in pruned.err
    assert gaitswarm("best", finished.id, "--db", finished.db, "--json").json
