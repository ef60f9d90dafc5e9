"""Cost of reading jobs: no more rows than are shown, and their documents once."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from sqlalchemy import Engine, create_engine, event, text

from gaitswarm.services.optimizer.jobs.job import Command, JobOrder, JobState
from gaitswarm.services.optimizer.jobs.labels import LabelsChange
from gaitswarm.services.optimizer.store import Store, open_store
from gaitswarm.services.optimizer.store.engine import Database, parse_url
from tests.store.examples import completed, spec
from tests.store.test_job_list import with_fitness

_RENAMED = {
    "sqlite": "UPDATE jobs SET spec = replace(spec, 'first', 'other')",
    "postgresql": "UPDATE jobs SET spec = CAST(replace(CAST(spec AS text), 'first', 'other') AS json)",  # noqa: E501
}


@contextmanager
def statements() -> Iterator[list[tuple[str, Any]]]:
    """What is sent to databases inside the block, with its parameters."""
    sent: list[tuple[str, Any]] = []

    def note(_: Any, __: Any, statement: str, parameters: Any, *___: Any) -> None:
        sent.append((statement, parameters))

    event.listen(Engine, "before_cursor_execute", note)
    try:
        yield sent
    finally:
        event.remove(Engine, "before_cursor_execute", note)


@pytest.mark.parametrize(
    "question",
    [
        {},
        {"state": JobState.QUEUED},
        {"order": JobOrder.FITNESS},
    ],
    ids=["newest", "of a state", "by fitness"],
)
def test_sqlite_finds_a_page_of_the_list_by_an_index_and_sorts_no_more_than_it(
    migrated_sqlite: Any, question: dict[str, Any]
) -> None:
    url = f"sqlite:///{migrated_sqlite}"
    store = open_store(url)
    cursors = [None, "created:1767268800000000:" + "b" * 12]
    if "order" in question:
        cursors = [None, "fitness:1.5:" + "b" * 12, "fitness:null:" + "b" * 12]
    with statements() as sent:
        for after in cursors:
            store.jobs(after=after, limit=5, **question)
    store.close()
    selected = [(s, p) for s, p in sent if s.startswith("SELECT")]
    assert len(selected) >= len(cursors)
    database = Database(url)
    with database.read() as connection:
        for statement, parameters in selected:
            plan = connection.exec_driver_sql(f"EXPLAIN QUERY PLAN {statement}", parameters).all()
            steps = [str(row[-1]) for row in plan]
            ids = steps[steps.index("LIST SUBQUERY 1") + 1]
            assert "USING INDEX ix_jobs" in ids, steps
            # Of the page alone.
            assert steps.count("USE TEMP B-TREE FOR ORDER BY") <= 1, steps
    database.close()


def test_a_spec_is_read_once_and_again_when_its_text_is_another(
    store: Store, database_url: str
) -> None:
    made, _ = store.create_job(spec(name="first"))
    first = store.job(made.id)
    assert store.job(made.id).spec is first.spec
    assert store.jobs().items[0].spec is first.spec
    database = Database(database_url)
    with database.write() as connection:
        connection.execute(text(_RENAMED[connection.dialect.name]))
    database.close()
    assert store.job(made.id).spec == spec(name="other").resolved()
    assert first.spec.name == "first"


def test_what_is_remembered_of_a_job_has_its_current_state_budget_and_progress(
    store: Store,
) -> None:
    job, _ = store.create_job(spec())
    before = store.job(job.id)
    store.extend(job.id, 40)
    with_fitness(store, job, 2.0)
    after = store.job(job.id)
    assert (before.spec.iterations, after.spec.iterations) == (spec().iterations, 40)
    assert (before.state, after.state) == (JobState.QUEUED, JobState.RUNNING)
    assert (before.progress.iterations, after.progress.iterations) == (0, 1)
    assert after.progress.evaluations == len(completed(0, (2.0, 3.0)).fitness)


def test_the_list_is_sorted_again_once_another_process_or_this_one_has_changed_a_job(
    store: Store, database_url: str
) -> None:
    jobs = [store.create_job(spec(name=name))[0].id for name in "ab"]

    def by_name() -> list[str]:
        return [job.id for job in store.jobs(order=JobOrder.NAME).items]

    other = open_store(database_url)
    assert by_name() == by_name() == jobs
    other.label(jobs[0], LabelsChange(name="c"))
    assert by_name() == by_name() == jobs[::-1]
    store.label(jobs[1], LabelsChange(name="d"))
    assert by_name() == by_name() == jobs
    third = other.create_job(spec(name="a"))[0].id
    assert by_name() == by_name() == [third, *jobs]
    store.command(third, Command.CANCEL)
    other.delete_job(third)
    assert by_name() == by_name() == jobs
    other.close()


def test_a_change_is_seen_that_was_begun_before_another_and_committed_after_it(
    store: Store, database_url: str
) -> None:
    if "postgresql" not in database_url:
        pytest.skip("SQLite has one writer at a time")
    for name in "ab":
        store.create_job(spec(name=name))

    def by_priority() -> list[str]:
        return [job.id for job in store.jobs(order=JobOrder.PRIORITY).items]

    first, second = by_priority()
    engine = create_engine(parse_url(database_url))
    try:
        with engine.connect() as late:
            raised = text("UPDATE jobs SET priority = priority + 1 WHERE id = :id")
            late.execute(raised, {"id": second})
            store.label(first, LabelsChange(name="c"))
            assert by_priority() == [first, second]
            late.commit()
        assert by_priority() == [second, first]
    finally:
        engine.dispose()
