"""The history of a job is chained as it is stored, and what is changed afterwards is found."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest
from sqlalchemy import text

from gaitswarm.services.optimizer.analysis.verification import HistoryCheck, check_history
from gaitswarm.services.optimizer.jobs.chain import (
    ChainDocuments,
    Link,
    ask_digest,
    iteration_digest,
)
from gaitswarm.services.optimizer.jobs.fork import Fork, Lineage, TakenHistory
from gaitswarm.services.optimizer.jobs.iteration import Reevaluation
from gaitswarm.services.optimizer.jobs.job import Claim, Command, JobState
from gaitswarm.services.optimizer.jobs.provenance import JobProvenance, job_provenance
from gaitswarm.services.optimizer.store import Store
from gaitswarm.services.optimizer.store.engine import Database
from gaitswarm.sim.outcome import Status
from tests.store.examples import LEASE, ask, begun, completed, spec


def checked(store: Store, job_id: str, head: str | None = None) -> HistoryCheck:
    return check_history(store, store.job(job_id), head=head)


def digests(store: Store, job_id: str) -> list[str | None]:
    return [iteration.digest for iteration in store.iterations(job_id).items]


def finished(store: Store) -> str:
    """A job of three iterations, one design of which failed."""
    claim = begun(store)
    store.commit(claim, completed(0), ask(1))
    store.commit(claim, completed(1, (1.5, math.inf)), ask(2))
    store.commit(claim, completed(2), None)
    return claim.job.id


def expected(documents: ChainDocuments) -> list[str]:
    """Digests of `finished`, computed from what was committed, without a database."""
    found, before = [], documents.digest
    for index, done in enumerate([completed(0), completed(1, (1.5, math.inf)), completed(2)]):
        asked = ask(index)
        link = Link(index, asked.positions, ask_digest(asked.positions, asked.state))
        before = iteration_digest(before, documents, link, done.columns, None)
        found.append(before)
    return found


def test_both_databases_store_the_digests_of_what_was_committed(store: Store) -> None:
    job_id = finished(store)
    documents = ChainDocuments(spec().resolved().model_dump(mode="json"), None, [])
    assert digests(store, job_id) == expected(documents)
    job = store.job(job_id)
    assert job.progress.head == digests(store, job_id)[-1]
    assert checked(store, job_id) == HistoryCheck(
        3, job.progress.head, head_found_at=None, sizes=(2, 2, 2)
    )


def test_the_same_job_has_the_same_digests_whatever_its_id(store: Store) -> None:
    assert digests(store, finished(store)) == digests(store, finished(store))
    claim = begun(store, name="another")
    store.commit(claim, completed(0), ask(1))
    assert digests(store, claim.job.id) != digests(store, finished(store))[:1]


def test_a_job_under_way_is_checked_as_far_as_it_is(store: Store) -> None:
    claim = begun(store)
    assert checked(store, claim.job.id) == HistoryCheck(0, None, None)
    store.commit(claim, completed(0), ask(1))
    found = checked(store, claim.job.id)
    assert (found.iterations, found.problem) == (1, "")


def test_a_digest_that_was_noted_down_is_found_again(store: Store) -> None:
    job_id = finished(store)
    noted = digests(store, job_id)
    assert [checked(store, job_id, head).head_found_at for head in noted] == [0, 1, 2]
    assert checked(store, job_id, "0" * 64).head_found_at is None


TAMPERED: dict[str, tuple[str, int]] = {
    "a number of a design": (
        "UPDATE evaluations SET design = :numbers WHERE iteration = 1 AND particle = 1",
        1,
    ),
    "an objective": (
        """UPDATE evaluations SET objectives = (
            SELECT e.objectives FROM evaluations e WHERE e.iteration = 0 AND e.particle = 0
        ) WHERE iteration = 2 AND particle = 0""",
        2,
    ),
    "a status": (
        "UPDATE evaluations SET statuses = :ok WHERE iteration = 1",
        1,
    ),
    "a fitness": ("UPDATE evaluations SET fitness = 1.25 WHERE iteration = 0 AND particle = 1", 0),
    "a failure": ("UPDATE evaluations SET fitness = 9 WHERE iteration = 1 AND particle = 1", 1),
    "what was asked": (
        "UPDATE iterations SET positions = :zeros WHERE iteration = 1",
        1,
    ),
    "the search's last state": (
        """UPDATE iterations SET optimizer_state = '{"iteration": 3}' WHERE iteration = 2""",
        2,
    ),
    "the digest of a state": (
        "UPDATE iterations SET ask_digest = 'aa' WHERE iteration = 0",
        0,
    ),
    "a digest": ("UPDATE iterations SET digest = 'aa' WHERE iteration = 1", 1),
    "no digest": ("UPDATE iterations SET digest = NULL WHERE iteration = 1", 1),
    "no first digest": ("UPDATE iterations SET digest = NULL WHERE iteration = 0", 0),
    "an order of designs": (
        "UPDATE evaluations SET particle = 3 - particle WHERE iteration = 1",
        1,
    ),
    "an order of iterations": (
        """UPDATE evaluations SET fitness = CASE iteration WHEN 0 THEN 1.5 ELSE 2.0 END
        WHERE iteration < 2 AND particle = 0""",
        0,
    ),
    "a design too few": ("DELETE FROM evaluations WHERE iteration = 1 AND particle = 1", 1),
    "evaluations of an iteration": ("DELETE FROM evaluations WHERE iteration = 2", 2),
    "a part of a number": ("UPDATE evaluations SET design = :part WHERE iteration = 1", 1),
    "a number too many": ("UPDATE evaluations SET design = :zeros WHERE iteration = 1", 1),
    "a position too few": ("UPDATE iterations SET positions = :part WHERE iteration = 1", 1),
    "no status": ("UPDATE evaluations SET statuses = :unknown WHERE iteration = 2", 2),
    "a summary": ("UPDATE iterations SET best_so_far = 1.0 WHERE iteration = 1", 1),
    "the job's spec": (
        """UPDATE jobs SET spec = '{"kind": "tuning", "seed": 5}'""",
        0,
    ),
    "the job's lineage": ("""UPDATE jobs SET lineage = '{"parent": "x"}'""", 0),
    "the job's provenance": ("""UPDATE jobs SET provenance = '[{"from_iteration": 1}]'""", 1),
}


BYTES = {
    "numbers": np.array([0.25, 0.5]).tobytes(),
    "zeros": bytes(32),
    "part": bytes(13),
    "ok": bytes([Status.OK, Status.OK]),
    "unknown": bytes([9, Status.OK]),
}


def execute(database_url: str, statement: str, **values: object) -> None:
    """values: of names after colons, besides `BYTES`; a colon before a space is JSON's."""
    database = Database(database_url)
    with database.write() as connection:
        connection.execute(text(statement.replace(": ", "\\: ")), BYTES | values)
    database.close()


@pytest.mark.variants(
    *("*-a number of a design", "sqlite-a status", "sqlite-what was asked", "sqlite-no digest"),
    *("sqlite-the digest of a state", "sqlite-an order of designs", "sqlite-a design too few"),
    *("sqlite-a part of a number", "sqlite-a summary", "sqlite-the job's spec"),
)
@pytest.mark.parametrize(("statement", "index"), TAMPERED.values(), ids=TAMPERED)
def test_what_was_changed_is_found_and_its_iteration_named(
    store: Store, database_url: str, statement: str, index: int
) -> None:
    job_id = finished(store)
    assert checked(store, job_id).problem == ""
    execute(database_url, statement)
    found = checked(store, job_id)
    assert found.problem
    assert found.broken_at == index
    assert found.iterations == index


def test_an_iteration_that_was_removed_is_missing(store: Store, database_url: str) -> None:
    for index in range(3):
        job_id = finished(store)
        of_it = {"job": job_id, "index": index}
        for statement in (
            "DELETE FROM evaluations WHERE job_id = :job AND iteration = :index",
            "DELETE FROM iterations WHERE job_id = :job AND iteration = :index",
        ):
            execute(database_url, statement, **of_it)
        found = checked(store, job_id)
        assert (found.broken_at, found.problem) == (index, "it is missing")


def test_an_end_that_was_cut_off_is_found_by_the_digest_that_was_noted_down(
    store: Store, database_url: str
) -> None:
    job_id = finished(store)
    noted = store.job(job_id).progress.head
    execute(database_url, "DELETE FROM evaluations WHERE iteration = 2")
    execute(database_url, "DELETE FROM iterations WHERE iteration = 2")
    execute(
        database_url,
        "UPDATE jobs SET iterations = 2, evaluations = 4, head ="
        " (SELECT digest FROM iterations WHERE job_id = jobs.id AND iteration = 1)",
    )
    found = checked(store, job_id, noted)
    assert (found.problem, found.head_found_at) == ("", None)


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        ("UPDATE jobs SET head = 'aa'", "the digest of the job"),
        ("UPDATE jobs SET evaluations = 5", "it has 6 evaluations"),
        ("UPDATE jobs SET best_fitness = 0.5", "best design"),
        ("UPDATE jobs SET best_particle = 1", "best design"),
    ],
)
def test_what_a_job_says_of_its_history_is_checked_too(
    store: Store, database_url: str, change: str, problem: str
) -> None:
    job_id = finished(store)
    execute(database_url, change)
    found = checked(store, job_id)
    assert found.broken_at is None and problem in found.problem


def test_what_is_asked_but_not_yet_evaluated_is_checked_too(
    store: Store, database_url: str
) -> None:
    claim = begun(store)
    store.commit(claim, completed(0), ask(1))
    execute(database_url, "UPDATE iterations SET positions = :zeros WHERE iteration = 1")
    found = checked(store, claim.job.id)
    assert found.broken_at == 1 and found.problem.startswith("the ask")


def test_a_design_that_was_reevaluated_is_chained_too(store: Store, database_url: str) -> None:
    store.create_job(spec().model_copy(update={"precision": "single"}))
    claim = store.claim("runner", lease_seconds=LEASE)
    assert claim is not None
    store.begin(claim, ask(0))
    reevaluation = Reevaluation(0, np.full((2, 6), 0.5), np.zeros(2, dtype=np.uint8), 2.5)
    done = completed(0)._replace(precision="single", reevaluation=reevaluation)
    store.commit(claim, done, ask(1))
    assert checked(store, claim.job.id).problem == ""
    execute(database_url, "UPDATE reevaluations SET fitness = 2.25")
    assert checked(store, claim.job.id).broken_at == 0
    execute(database_url, "DELETE FROM reevaluations")
    assert checked(store, claim.job.id).broken_at == 0


def other(provenance: JobProvenance) -> JobProvenance:
    return provenance.model_copy(update={"optimizer_digest": "0" * 32})


def test_a_change_of_provenance_that_was_accepted_is_chained_from_there_on(
    store: Store,
) -> None:
    here = job_provenance(spec())
    store.create_job(spec(), provenance=here)
    claim = store.claim("a", lease_seconds=LEASE)
    assert claim is not None
    store.begin(claim, ask(0))
    store.commit(claim, completed(0), ask(1))
    store.release(claim, JobState.PAUSED)
    store.command(claim.job.id, Command.RESUME, accept_changes=True)
    resumed = store.claim("b", lease_seconds=LEASE)
    assert resumed is not None
    store.record_provenance(resumed, other(here))
    store.commit(resumed, completed(1), ask(2))
    assert checked(store, claim.job.id).problem == ""

    store.create_job(spec(), provenance=here)
    unchanged = store.claim("a", lease_seconds=LEASE)
    assert unchanged is not None
    store.begin(unchanged, ask(0))
    store.commit(unchanged, completed(0), ask(1))
    store.commit(unchanged, completed(1), ask(2))
    first, second = digests(store, claim.job.id)
    same, other_second = digests(store, unchanged.job.id)
    assert first == same and second != other_second


def test_records_of_provenance_stay_as_they_were_written_when_others_follow(
    store: Store, database_url: str
) -> None:
    here = job_provenance(spec())
    job, _ = store.create_job(spec(), provenance=here)
    # As a version wrote it that did not know a field yet.
    provenance = here.model_dump(mode="json", exclude={"search_libraries"})
    record = {"from_iteration": 0, "provenance": provenance}
    execute(database_url, "UPDATE jobs SET provenance = :record", record=json.dumps([record]))
    claim = store.claim("a", lease_seconds=LEASE)
    assert claim is not None
    store.begin(claim, ask(0))
    store.commit(claim, completed(0), ask(1))
    store.record_provenance(claim, other(here))
    store.commit(claim, completed(1), ask(2))
    assert checked(store, job.id).problem == ""
    stored = store.chain_documents(job.id).provenance
    assert stored is not None and stored[0] == record and len(stored) == 2


def test_an_extended_job_continues_with_its_chain(store: Store) -> None:
    job_id = finished(store)
    before = digests(store, job_id)
    store.extend(job_id, 4)
    claim = store.claim("b", lease_seconds=LEASE, job_id=job_id)
    assert claim is not None
    store.begin(claim, ask(3))
    store.commit(claim, completed(3), None)
    assert digests(store, job_id)[:3] == before
    found = checked(store, job_id, before[-1])
    assert (found.iterations, found.problem, found.head_found_at) == (4, "", 2)


def forked(store: Store, parent: str, fitness: tuple[Any, ...] | None = None) -> Claim:
    lineage = Lineage(parent=parent, from_iteration=2, carried="search")
    taken = TakenHistory({"schema_version": 1, "iteration": 1}, fitness, ())
    store.create_job(spec(), fork=Fork(lineage, taken))
    claim = store.claim("b", lease_seconds=LEASE)
    assert claim is not None
    return claim


@pytest.mark.parametrize("fitness", [None, (np.array([4.0, 5.0]), np.array([6.0, math.inf]))])
def test_a_fork_chains_what_it_takes_over_under_its_own_lineage(
    store: Store, database_url: str, fitness: tuple[Any, ...] | None
) -> None:
    parent = finished(store)
    claim = forked(store, parent, fitness)
    fork = claim.job.id
    assert set(digests(store, fork)).isdisjoint(digests(store, parent))
    found = checked(store, fork)
    assert (found.iterations, found.problem) == (2, "")
    store.begin(claim, ask(2))
    store.commit(claim, completed(2), None)
    assert checked(store, fork).iterations == 3
    execute(
        database_url,
        "UPDATE evaluations SET fitness = 4.5 WHERE job_id = :job AND iteration = 0",
        job=fork,
    )
    assert checked(store, fork).broken_at == 0
    assert checked(store, parent).problem == ""
