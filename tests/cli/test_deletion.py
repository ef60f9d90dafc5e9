"""`gaitswarm delete` and `keep`."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.cli.conftest import Finished, Gaitswarm


@pytest.fixture
def db(finished: Finished, tmp_path: Path) -> Path:
    """A copy of the database, which a test may change."""
    return Path(shutil.copy(finished.db, tmp_path / "copy.db"))


@pytest.fixture
def answering(monkeypatch: pytest.MonkeyPatch) -> Callable[[bool], None]:
    """Simulate a terminal whose user answers yes or no."""

    def answer(yes: bool) -> None:
        monkeypatch.setattr("sys.stdin.isatty", lambda: True)
        monkeypatch.setattr("typer.confirm", lambda *_, **__: yes)

    return answer


@pytest.mark.parametrize("yes", [True, False])
def test_deletion_describes_the_loss_and_asks_for_confirmation(
    gaitswarm: Gaitswarm, finished: Finished, db: Path, answering: Callable[[bool], None], yes: bool
) -> None:
    assert gaitswarm("fork", finished.id, "--from", "1", "--db", db).code == 0
    answering(yes)
    deleted = gaitswarm("delete", finished.id, "--db", db)
    assert deleted.code == 0
    assert "removes 2 iterations with 6 evaluated designs" in deleted.err
    assert "forks that keep their copies of its iterations: 1" in deleted.err
    assert gaitswarm("status", finished.id, "--db", db).code == (3 if yes else 0)


def test_without_a_terminal_deletion_requires_yes(
    gaitswarm: Gaitswarm, finished: Finished, db: Path
) -> None:
    refused = gaitswarm("delete", finished.id, "--db", db)
    assert refused.code == 2 and "--yes" in refused.err
    assert gaitswarm("status", finished.id, "--db", db).code == 0
    deleted = gaitswarm("delete", finished.id, "--yes", "--db", db)
    assert (deleted.code, deleted.out) == (0, f"job {finished.id} is deleted\n")
    assert f"gaitswarm delete --undo {finished.id}" in deleted.err
    assert gaitswarm("delete", finished.id, "--yes", "--db", db).code == 3


def test_a_deletion_is_undone(gaitswarm: Gaitswarm, finished: Finished, db: Path) -> None:
    assert gaitswarm("delete", finished.id, "--yes", "--db", db).code == 0
    undone = gaitswarm("delete", "--undo", finished.id, "--db", db)
    assert (undone.code, undone.out) == (0, f"job {finished.id} is restored\n")
    assert gaitswarm("status", finished.id, "--db", db).code == 0
    again = gaitswarm("delete", "--undo", finished.id, "--db", db)
    assert again.code == 3 and "was deleted in the last 24 hours" in again.err


def test_a_kept_job_is_not_deleted(gaitswarm: Gaitswarm, finished: Finished, db: Path) -> None:
    assert gaitswarm("keep", finished.id, "--db", db).out == f"job {finished.id} is kept\n"
    refused = gaitswarm("delete", finished.id, "--yes", "--db", db)
    assert refused.code == 4 and "gaitswarm keep --release" in refused.err
    assert not gaitswarm("keep", finished.id, "--release", "--db", db, "--json").json["kept"]
    assert gaitswarm("delete", finished.id, "--yes", "--db", db).code == 0
