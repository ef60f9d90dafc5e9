"""The stored history of a job is the one that was committed, in its database and its evidence."""

from __future__ import annotations

import json
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

import gaitswarm
from gaitswarm.cli.exit_codes import ExitCode
from gaitswarm.evidence.archive import MANIFEST, archived, unzipped
from gaitswarm.sim.outcome import OBJECTIVE_NAMES
from gaitswarm.views.verification import CheckView, HistoryVerificationView
from tests.evidence.conftest import CHAIN, EVALUATIONS, JOB, Proved, tampered, with_cells
from tests.examples.commands import run_command

pytestmark = pytest.mark.slow


@pytest.fixture
def copy(proved: Proved, tmp_path: Path) -> Path:
    """A copy of the database, which a test may change."""
    return Path(shutil.copy(proved.db, tmp_path / "jobs.db"))


def execute(db: Path, statement: str) -> None:
    with closing(sqlite3.connect(db)) as connection:
        connection.execute(statement)
        connection.commit()


def verified(db: Path, job_id: str, **given: object) -> HistoryVerificationView:
    with gaitswarm.open(db) as jobs:
        return jobs.verify(job_id, **given)  # type: ignore[arg-type]


def of(name: str, checks: list[CheckView]) -> tuple[bool | None, str]:
    (check,) = [check for check in checks if check.name == name]
    return check.passed, check.detail


def digests(db: Path, job_id: str) -> list[str]:
    with gaitswarm.open(db) as jobs:
        found = [iteration.digest for iteration in jobs.iterations(job_id)]
        assert found[-1] == jobs.job(job_id).head
    return [digest for digest in found if digest is not None]


def test_an_untouched_history_is_verified_and_replayed(proved: Proved) -> None:
    found = verified(proved.db, proved.id, replay=5, seed=3)
    assert found.verified and found.differences == []
    assert (found.iterations, found.broken_at) == (3, None)
    assert found.replayed in (5, 6), "those that were drawn, and the best one"
    head = digests(proved.db, proved.id)[-1]
    assert found.head == head
    assert of("chain", found.checks) == (True, f"3 iterations chained, head {head}")
    again = verified(proved.db, proved.id, replay=5, seed=3)
    assert again == found, "the seed draws the same evaluations"


def test_a_single_job_run_twice_has_the_same_head(proved: Proved, tmp_path: Path) -> None:
    run = gaitswarm.optimize(db=tmp_path / "jobs.db", **JOB)
    assert run.job.id != proved.id
    assert run.job.head == digests(proved.db, proved.id)[-1]


@pytest.mark.parametrize(
    ("statement", "problem"),
    [
        (
            "UPDATE evaluations SET design = zeroblob(16) WHERE iteration = 1 AND particle = 2",
            "design 2 differs from the ask",
        ),
        (
            "UPDATE evaluations SET fitness = fitness * 1.001 WHERE iteration = 1 AND particle = 0",
            "the fitness of design 0 does not follow from its objectives and statuses",
        ),
        ("UPDATE iterations SET mean = mean * 2 WHERE iteration = 1", "its mean does not follow"),
    ],
)
def test_what_was_changed_is_named(
    copy: Path, proved: Proved, statement: str, problem: str
) -> None:
    execute(copy, statement)
    found = verified(copy, proved.id)
    assert not found.verified
    assert (found.broken_at, found.iterations) == (1, 1)
    passed, detail = of("chain", found.checks)
    assert passed is False and detail.startswith(f"iteration 1: {problem}")


def test_a_check_of_the_database_names_job_and_iteration_unless_histories_are_skipped(
    copy: Path, proved: Proved
) -> None:
    sound = run_command("db", "check", "--db", copy, "--json")
    assert (sound.code, sound.json) == (ExitCode.OK, [])
    execute(copy, "UPDATE evaluations SET fitness = fitness * 1.001 WHERE iteration > 0")
    broken = run_command("db", "check", "--db", copy, "--json")
    assert broken.code == ExitCode.JOB_FAILED
    (finding,) = broken.json
    assert finding.startswith(
        f"job {proved.id} differs from what was committed: iteration 1: the fit"
    )
    skipped = run_command("db", "check", "--db", copy, "--skip-histories", "--json")
    assert (skipped.code, skipped.json) == (ExitCode.OK, [])


def test_a_number_that_was_changed_with_its_digests_is_found_by_the_replay(
    copy: Path, proved: Proved
) -> None:
    """A writer of the database can recompute the chain, but cannot forge simulations."""
    from gaitswarm.services.optimizer.jobs.chain import iteration_digest
    from gaitswarm.services.optimizer.store import open_store

    with closing(sqlite3.connect(copy)) as connection:
        (content,) = connection.execute(
            "SELECT objectives FROM evaluations WHERE iteration = 0 AND particle = 1"
        ).fetchone()
        objectives = np.frombuffer(content).copy()
        # Loss of height has no part in the fitness.
        objectives[OBJECTIVE_NAMES.index("height_loss")] *= 1.5
        connection.execute(
            "UPDATE evaluations SET objectives = ? WHERE iteration = 0 AND particle = 1",
            (objectives.tobytes(),),
        )
        connection.commit()
    noted = digests(copy, proved.id)[-1]
    with closing(open_store(str(copy))) as store:
        documents = store.chain_documents(proved.id)
        columns = store.evaluation_columns(proved.id, 0, 3)
        links = store.links(proved.id, 0, 3)
    assert columns is not None
    head = documents.digest
    for link in links:
        rows = columns.of_iteration(link.iteration)
        head = iteration_digest(head, documents, link, rows, None)
        execute(copy, f"UPDATE iterations SET digest = '{head}' WHERE iteration = {link.iteration}")  # noqa: S608
    execute(copy, f"UPDATE jobs SET head = '{head}'")  # noqa: S608

    assert verified(copy, proved.id).verified
    found = verified(copy, proved.id, replay=100, head=noted)
    assert [check.name for check in found.checks if check.passed is False] == ["head", "replay"]
    (difference,) = found.differences
    assert (difference.iteration, difference.particle) == (0, 1)
    assert difference.what == "height_loss"


def test_a_digest_that_was_noted_down_says_whether_it_is_the_same_history(proved: Proved) -> None:
    first, _, last = digests(proved.db, proved.id)
    for head, said in (
        (last, (True, f"iteration 2, the last, has the digest {last}")),
        (first, (True, f"iteration 0 has the digest {first}; 2 more were committed since")),
        ("0" * 64, (False, f"no iteration has the digest {'0' * 64}: this is a different history")),
    ):
        in_database = verified(proved.db, proved.id, head=head)
        in_file = gaitswarm.verify(proved.content, replay=0, head=head)
        assert of("head", in_database.checks) == of("head", in_file.checks) == said
        assert in_database.verified == in_file.verified == said[0]


def test_arguments_that_make_no_sense_are_refused(proved: Proved) -> None:
    for given in ({"replay": -1}, {"seed": -1}, {"head": "abc"}):
        (field,) = given
        with pytest.raises(gaitswarm.InvalidRequest) as refused:
            verified(proved.db, proved.id, **given)
        assert refused.value.field == field
    with pytest.raises(gaitswarm.InvalidRequest):
        gaitswarm.verify(proved.content, head="abc")
    with pytest.raises(gaitswarm.NotFound):
        verified(proved.db, "nosuchjob")


def test_evidence_holds_the_chain_and_is_checked_by_it(proved: Proved) -> None:
    document = json.loads(unzipped(proved.content)[CHAIN])
    assert document["version"] == 1
    assert document["digests"] == digests(proved.db, proved.id)
    found = gaitswarm.verify(proved.content, replay=0)
    passed, detail = of("chain", found.checks)
    assert passed and detail.endswith(f"head {document['digests'][-1]}")


def test_evidence_whose_tables_are_not_those_of_the_chain_is_refused(proved: Proved) -> None:
    def change(columns: dict[str, list[object]]) -> None:
        value = columns["short.height_loss"][5]
        assert isinstance(value, float)
        columns["short.height_loss"][5] = value * 1.5

    content = tampered(proved.content, {EVALUATIONS: with_cells(change)})
    found = gaitswarm.verify(content, replay=0)
    assert [check.name for check in found.checks if check.passed is False] == ["chain"]
    assert of("chain", found.checks)[1].startswith("iteration 1: ")


@pytest.mark.variants("*lineage*", "*'digests': ['a']*", "*asks': [1]*")
@pytest.mark.parametrize(
    "change",
    [
        {"spec": {"kind": "tuning", "controller": "pi"}},
        {"lineage": {"parent": "x", "from_iteration": 1, "carried": "search"}},
        {"provenance": []},
        {"provenance": None},
        {"digests": ["a"]},
        {"digests": [None, "a" * 64, None]},
        {"asks": [None, None, None]},
        {"asks": [1]},
        {"version": "x"},
    ],
    ids=str,
)
def test_a_chain_that_is_not_of_the_file_fails(proved: Proved, change: dict[str, object]) -> None:
    changed = {CHAIN: lambda content: json.dumps(json.loads(content) | change).encode()}
    found = gaitswarm.verify(tampered(proved.content, changed), replay=0)
    assert not found.verified
    assert next(c.name for c in found.checks if c.passed is False) in ("chain", "contents")


def test_a_fork_certifies_the_history_that_it_was_forked_from(copy: Path, proved: Proved) -> None:
    with gaitswarm.open(copy) as jobs:
        fork = jobs.run(jobs.fork(proved.id, 2).id)
        assert fork.lineage is not None
        assert fork.lineage.digest == digests(copy, proved.id)[1]
        found = jobs.verify(fork.id)
        assert found.verified and found.iterations == 3
        content = jobs.evidence(fork.id)
    assert of("chain", gaitswarm.verify(content, replay=0).checks)[0] is True


def test_the_command_line_names_the_first_iteration_that_differs(
    copy: Path, proved: Proved
) -> None:
    head = digests(copy, proved.id)[-1]
    arguments = ("verify", proved.id, "--db", copy, "--replay", 2)
    done = run_command(*arguments, "--head", head)
    assert done.code == 0, done.err
    assert f"3 iterations chained, head {head[:8]}" in " ".join(done.out.split())
    execute(copy, "UPDATE evaluations SET fitness = 1 WHERE iteration = 2 AND particle = 3")
    done = run_command(*arguments, "--json")
    assert done.code == ExitCode.JOB_FAILED
    assert done.json["broken_at"] == 2
    done = run_command(*arguments)
    assert "iteration 2: the fitness of design 3" in " ".join(done.out.split())


def test_evidence_without_a_chain_is_refused(proved: Proved) -> None:
    members = {name: m for name, m in unzipped(proved.content).items() if name != CHAIN}
    del members[MANIFEST]
    found = gaitswarm.verify(archived(members), replay=0)
    assert not found.verified
    assert of("contents", found.checks) == (False, f"it has no {CHAIN}")
