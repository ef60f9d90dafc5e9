"""Jobs stored by another version, or edited: they fail alone, and lose nothing."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import Text, cast, select, text

from gaitswarm.services.optimizer.errors import (
    Conflict,
    IdempotencyConflict,
    StoreUnavailable,
    Unreadable,
)
from gaitswarm.services.optimizer.jobs.job import Command, Job, JobOrder, JobState
from gaitswarm.services.optimizer.jobs.kinds.calibration import IdentificationSpec
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store import Store, open_store
from gaitswarm.services.optimizer.store.engine import Database
from gaitswarm.services.optimizer.store.tables import jobs
from tests.examples.hostile import TOML, URDF, chain
from tests.store.examples import LEASE, Clock, begun, completed, spec
from tests.store.test_recordings import recording

Write = Callable[[str, str], None]


@pytest.fixture
def write_spec(database_url: str) -> Write:
    """Puts a text in place of a job's spec, as another version or a person with an editor does."""
    return lambda job_id, document: execute(
        database_url, "UPDATE jobs SET spec = :document WHERE id = :id", document, job_id
    )


def execute(url: str, statement: str, document: str, job_id: str) -> None:
    database = Database(url)
    if database.engine.dialect.name == "postgresql":
        statement = statement.replace(":document", "CAST(:document AS json)")
    with database.write() as connection:
        connection.execute(text(statement), {"document": document, "id": job_id})
    database.close()


def stored(url: str, job_id: str) -> Mapping[str, Any]:
    """A job's row as the database holds it, its spec as text."""
    database = Database(url)
    columns = [c if c.name != "spec" else cast(c, Text).label("spec") for c in jobs.c]
    with database.read() as connection:
        row = connection.execute(select(*columns).where(jobs.c.id == job_id)).mappings().one()
    database.close()
    return dict(row)


def document(**changes: object) -> str:
    return json.dumps(spec(name="mine").resolved().model_dump(mode="json") | changes)


UNREADABLE = {
    "newer": document(schema_version=99),
    "of an unknown kind": document(kind="gardening"),
    "with an unknown field": document(colour="red"),
    "of a wrong type": document(scenarios=7, name=None, iterations="many", optimizer=None),
    "of before there were limits": document(robot={"toml": TOML, "urdf": chain(4500)}),
    "with keys that nest": document(robot={"toml": ".".join("a" * 90_000) + "=1", "urdf": URDF}),
    "no object": '"a spec"',
    "null": "null",
}


@pytest.fixture(params=list(UNREADABLE))
def unreadable(request: pytest.FixtureRequest) -> str:
    return UNREADABLE[request.param]


@pytest.fixture
def damaged(store: Store, write_spec: Write, unreadable: str) -> Job:
    """A queued job, older than all others of a test, whose spec cannot be read."""
    job, _ = store.create_job(spec(), idempotency_key="damaged")
    write_spec(job.id, unreadable)
    return store.job(job.id)


@pytest.mark.variants("sqlite-newer", "sqlite-with keys that nest", "sqlite-no object")
def test_the_next_job_is_claimed_and_the_unreadable_one_has_failed_with_its_reason(
    store: Store, clock: Clock, damaged: Job
) -> None:
    clock.advance(1.0)
    sound, _ = store.create_job(spec())
    claim = store.claim("runner", lease_seconds=LEASE)
    assert claim is not None and claim.job.id == sound.id
    assert store.claim("runner", lease_seconds=LEASE) is None
    failed = store.job(damaged.id)
    assert (failed.state, failed.finished_at) == (JobState.FAILED, clock.now)
    assert failed.error is not None
    assert "cannot be read" in failed.error and "resume" in failed.error


@pytest.mark.variants("sqlite-newer", "sqlite-no object")
def test_nothing_else_of_its_row_is_touched(
    store: Store, clock: Clock, damaged: Job, database_url: str, unreadable: str
) -> None:
    before = stored(database_url, damaged.id)
    clock.advance(1.0)
    assert store.claim("runner", lease_seconds=LEASE, job_id=damaged.id) is None
    after = stored(database_url, damaged.id)
    changed = {name for name in after if after[name] != before[name]}
    assert changed == {"state", "error", "updated_at", "finished_at"}
    assert after["spec"] == unreadable


@pytest.mark.variants("sqlite-newer", "sqlite-null")
def test_lists_show_it_among_the_others(store: Store, clock: Clock, damaged: Job) -> None:
    clock.advance(1.0)
    sound, _ = store.create_job(spec(name="sound"))
    assert [job.id for job in store.jobs().items] == [sound.id, damaged.id]
    for order in JobOrder:
        listed = store.jobs(order=order, search="").items
        assert {job.id for job in listed} == {sound.id, damaged.id}
        first = store.jobs(order=order, limit=1)
        second = store.jobs(order=order, limit=1, after=first.next)
        assert {job.id for job in (*first.items, *second.items)} == {sound.id, damaged.id}
    assert [job.id for job in store.jobs(search="sound").items] == [sound.id]
    assert [job.id for job in store.jobs(search=damaged.id).items] == [damaged.id]
    assert store.jobs(kind="certificate").items == ()


@pytest.mark.variants("sqlite-newer", "sqlite-of an unknown kind", "sqlite-no object")
def test_its_spec_is_refused_with_the_reason_to_its_users(store: Store, damaged: Job) -> None:
    assert not damaged.readable
    with pytest.raises(Conflict, match=rf"{damaged.id}: its spec cannot be read"):
        _ = damaged.spec
    with pytest.raises(Unreadable, match="cannot be read"):
        store.extend(damaged.id, 40)


@pytest.mark.variants("sqlite-newer", "sqlite-with an unknown field")
def test_it_can_be_resumed_by_a_version_that_can_read_it_and_by_no_other(
    store: Store, damaged: Job, write_spec: Write
) -> None:
    claim = store.claim("runner", lease_seconds=LEASE)
    assert claim is None
    before = store.job(damaged.id)
    with pytest.raises(Unreadable, match="resume"):
        store.command(damaged.id, Command.RESUME)
    assert store.job(damaged.id) == before
    # What a version does that can read what is stored.
    write_spec(damaged.id, document())
    assert store.job(damaged.id).readable
    assert store.command(damaged.id, Command.RESUME).state is JobState.QUEUED
    claim = store.claim("runner", lease_seconds=LEASE)
    assert claim is not None and claim.job.spec == spec(name="mine").resolved()


@pytest.mark.variants("sqlite-newer", "sqlite-null")
def test_it_can_be_cancelled(store: Store, damaged: Job) -> None:
    assert store.command(damaged.id, Command.CANCEL).state is JobState.CANCELLED


@pytest.mark.variants("sqlite-newer", "sqlite-of a wrong type")
def test_its_key_still_means_it(store: Store, damaged: Job) -> None:
    assert store.create_job(spec(), idempotency_key="damaged") == (damaged, False)
    with pytest.raises(IdempotencyConflict, match="cannot be read"):
        store.create_job(spec(iterations=9), idempotency_key="damaged")


def test_what_is_committed_stays_to_be_read(store: Store, write_spec: Write) -> None:
    claim = begun(store)
    store.commit(claim, completed(0, (2.0, 3.0)), None)
    before = store.iterations(claim.job.id)
    write_spec(claim.job.id, UNREADABLE["newer"])
    assert store.iterations(claim.job.id) == before
    assert [found.fitness for found in store.evaluations(claim.job.id, 0)] == [2.0, 3.0]
    assert store.job(claim.job.id).progress.iterations == 1


def test_a_job_under_way_that_cannot_be_read_any_more_is_claimed_by_no_runner(
    store: Store, clock: Clock, write_spec: Write
) -> None:
    claim = begun(store)
    write_spec(claim.job.id, UNREADABLE["newer"])
    clock.advance(LEASE)
    assert store.claim("runner", lease_seconds=LEASE) is None
    assert store.job(claim.job.id).state is JobState.FAILED


def test_a_name_that_can_be_read_is_shown(store: Store, write_spec: Write) -> None:
    job, _ = store.create_job(spec(name="mine"))
    write_spec(job.id, UNREADABLE["newer"])
    (found,) = store.jobs(search="min").items
    assert found.name == json.loads(UNREADABLE["newer"])["name"] != ""


@pytest.mark.parametrize("document", ['{"name": "cut o', "[" * 100_000], ids=["cut", "deep"])
@pytest.mark.parametrize("database_url", ["sqlite"], indirect=True)
def test_a_spec_that_is_no_json_at_all_fails_alone_too(
    store: Store, clock: Clock, write_spec: Write, database_url: str, document: str
) -> None:
    job, _ = store.create_job(spec())
    write_spec(job.id, document)
    clock.advance(1.0)
    sound, _ = store.create_job(spec())
    claim = store.claim("runner", lease_seconds=LEASE)
    assert claim is not None and claim.job.id == sound.id
    error = store.job(job.id).error
    assert error is not None and "not JSON" in error
    for order in JobOrder:
        assert len(store.jobs(order=order).items) == 2
    assert stored(database_url, job.id)["spec"] == document


@pytest.mark.parametrize("database_url", ["sqlite"], indirect=True)
def test_a_spec_that_is_not_even_text_fails_alone_too(
    store: Store, clock: Clock, database_url: str
) -> None:
    job, _ = store.create_job(spec())
    # SQLite keeps bytes that are no UTF-8, as a damaged disk leaves them.
    damage = "UPDATE jobs SET spec = CAST(x'7b22ff' || :document AS TEXT) WHERE id = :id"
    execute(database_url, damage, "", job.id)
    clock.advance(1.0)
    sound, _ = store.create_job(spec())
    claim = store.claim("runner", lease_seconds=LEASE)
    assert claim is not None and claim.job.id == sound.id
    error = store.job(job.id).error
    assert error is not None and "not JSON" in error
    for order in JobOrder:
        assert len(store.jobs(order=order).items) == 2


@pytest.mark.parametrize("recorded", ["{}", "0", "false", '""'])
def test_a_provenance_that_is_no_list_is_not_taken_for_none(
    store: Store, database_url: str, recorded: str
) -> None:
    job, _ = store.create_job(spec())
    execute(database_url, "UPDATE jobs SET provenance = :document WHERE id = :id", recorded, job.id)
    assert store.claim("runner", lease_seconds=LEASE) is None
    error = store.job(job.id).error
    assert error is not None and "its provenance cannot be read" in error


@pytest.mark.parametrize(
    "recorded", ['{"first_tick": "noon"}', None], ids=["that cannot be read", "that is gone"]
)
def test_a_job_with_a_recording_is_set_aside_too(
    store: Store, clock: Clock, database_url: str, recorded: str | None
) -> None:
    name = store.add_recording(recording())
    job, _ = store.create_job(
        IdentificationSpec(kind="identification", recordings=(name,), variables=("body_mass",))
    )
    clock.advance(1.0)
    sound, _ = store.create_job(spec())
    statement = "UPDATE recordings SET document = :document WHERE id = :id"
    if recorded is None:
        statement = "DELETE FROM recordings WHERE id = :id"
    execute(database_url, statement, recorded or "", name)
    claim = store.claim("runner", lease_seconds=LEASE)
    assert claim is not None and claim.job.id == sound.id
    failed = store.job(job.id)
    assert failed.state is JobState.FAILED and failed.readable
    assert failed.error is not None and "recording" in failed.error and "resume" in failed.error
    if recorded is not None:
        with pytest.raises(Unreadable, match=name):
            JobService(store).recording(name)


def test_a_recording_that_cannot_be_read_hides_no_other_in_the_list(
    store: Store, database_url: str
) -> None:
    whole, broken = (store.add_recording(recording(first_tick=k)) for k in (20, 21))
    statement = "UPDATE recordings SET document = :document WHERE id = :id"
    # PostgreSQL itself refuses what is no JSON.
    damaged = ['{"current": [[0.1]]', "[]"] if "sqlite" in database_url else ["[]"]
    for document in damaged:
        execute(database_url, statement, document, broken)
        for search in ("", broken):
            entries = {entry.id: entry for entry in store.recording_list(search=search).items}
            assert entries[broken].rows == 10
            assert (whole in entries) is (search == "")


def test_a_job_whose_ask_cannot_be_read_is_set_aside_too(
    store: Store, clock: Clock, database_url: str
) -> None:
    first = begun(store)
    store.release(first, JobState.QUEUED)
    statement = "UPDATE iterations SET designs = 3 WHERE job_id = :id"
    execute(database_url, statement, "", first.job.id)
    clock.advance(1.0)
    sound, _ = store.create_job(spec())
    claim = store.claim("runner", lease_seconds=LEASE)
    assert claim is not None and claim.job.id == sound.id
    failed = store.job(first.job.id)
    assert failed.state is JobState.FAILED
    assert failed.error is not None and "iteration 0" in failed.error


def test_a_job_whose_provenance_cannot_be_read_is_set_aside_too(
    store: Store, clock: Clock, database_url: str
) -> None:
    job, _ = store.create_job(spec(name="mine"))
    statement = "UPDATE jobs SET provenance = :document WHERE id = :id"
    execute(database_url, statement, '[{"planet": "Mars"}]', job.id)
    assert [listed.id for listed in store.jobs().items] == [job.id]
    clock.advance(1.0)
    sound, _ = store.create_job(spec())
    claim = store.claim("runner", lease_seconds=LEASE)
    assert claim is not None and claim.job.id == sound.id
    error = store.job(job.id).error
    assert error is not None and "provenance" in error


@pytest.mark.variants("sqlite-of a wrong type")
def test_what_a_new_job_costs_is_not_asked_of_one_that_cannot_be_read(
    store: Store, damaged: Job
) -> None:
    # Two designs in two scenarios, three times.
    assert JobService(store).estimate(spec()).walks == 12


def test_a_damaged_time_is_reported_with_the_remedy(database: Path) -> None:
    store = open_store(str(database))
    job, _ = store.create_job(spec())
    execute(str(database), "UPDATE jobs SET created_at = :document WHERE id = :id", "\0\0", job.id)
    with pytest.raises(StoreUnavailable, match=r"a stored time is .*; put a backup"):
        store.jobs()
    store.close()
