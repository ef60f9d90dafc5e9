"""A PostgreSQL server sends the long documents of listed jobs once, and what is shown is true."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from typing import Any

import pytest
from sqlalchemy import Connection, Engine, create_engine, text

from gaitswarm.services.optimizer.jobs.job import Command, JobOrder
from gaitswarm.services.optimizer.jobs.labels import LabelsChange
from gaitswarm.services.optimizer.store.connections.engine import parse_url
from gaitswarm.services.optimizer.store.sql_store import SqlStore, open_store
from gaitswarm.services.optimizer.store.statements import job_list
from gaitswarm.services.optimizer.store.statements.job_list import read_long
from tests.store.examples import spec
from tests.store.test_job_reading import statements

Question = dict[str, Any]

pytestmark = [
    pytest.mark.slow,
    pytest.mark.parametrize(
        "question",
        [{}, {"order": JobOrder.FITNESS}, {"order": JobOrder.NAME}],
        ids=["newest", "by fitness", "by name"],
    ),
]


@pytest.fixture
def server_url(emptied_postgresql: Callable[[], str]) -> str:
    """Of an empty database."""
    return emptied_postgresql()


@pytest.fixture
def store(server_url: str) -> Iterator[SqlStore]:
    """The store on it."""
    with closing(open_store(server_url)) as opened:
        yield opened


@pytest.fixture
def engine(server_url: str) -> Iterator[Engine]:
    """Another program's connections to it."""
    made = create_engine(parse_url(server_url))
    yield made
    made.dispose()


def rename(engine: Engine, old: str, new: str) -> None:
    """Put another name into all specs."""
    with engine.begin() as connection:
        named = text("UPDATE jobs SET spec = CAST(replace(CAST(spec AS text), :old, :new) AS json)")
        connection.execute(named, {"old": old, "new": new})


def names(store: SqlStore, question: Question) -> list[str]:
    return [job.spec.name for job in store.jobs(**question).items]


def test_they_are_read_anew_only_of_jobs_that_have_changed(
    store: SqlStore, server_url: str, question: Question
) -> None:
    made = [store.create_job(spec(name=name))[0].id for name in ("first", "second", "third")]

    def read() -> int:
        """Of how many jobs, when two pages are read."""
        with statements() as sent:
            page = store.jobs(**question, limit=2)
            found = page.items + store.jobs(**question, limit=2, after=page.next).items
        assert sorted(job.id for job in found) == sorted(made)
        assert {job.spec.name for job in found} == {"first", "second", "third"}
        return sum(len(ids) for statement, ids in sent if "provenance" in statement)

    assert [read(), read()] == [3, 0]
    store.label(made[0], LabelsChange(note="mine"))
    with closing(open_store(server_url)) as other:
        other.label(made[1], LabelsChange(note="another's"))
    assert [read(), read()] == [2, 0]


def test_a_document_that_another_program_changes_is_shown_as_it_is(
    store: SqlStore, engine: Engine, question: Question
) -> None:
    store.create_job(spec(name="first"))
    assert names(store, question) == ["first"]
    rename(engine, "first", "other")
    assert names(store, question) == ["other"]


def test_what_another_program_writes_while_a_page_is_read_is_not_taken_for_what_was_there(
    store: SqlStore, engine: Engine, monkeypatch: pytest.MonkeyPatch, question: Question
) -> None:
    store.create_job(spec(name="first"))

    def changed_for_a_moment(connection: Connection, ids: Sequence[str]) -> Any:
        rename(engine, "first", "other")
        found = read_long(connection, ids)
        rename(engine, "other", "first")
        return found

    with monkeypatch.context() as patched:
        patched.setattr(job_list, "read_long", changed_for_a_moment)
        assert names(store, question) == ["other"]
    assert names(store, question) == ["first"]


def test_a_page_is_whole_though_one_of_its_jobs_is_removed_while_it_is_read(
    store: SqlStore, server_url: str, monkeypatch: pytest.MonkeyPatch, question: Question
) -> None:
    for name in ("first", "second", "third"):
        store.create_job(spec(name=name))
    with closing(open_store(server_url)) as other:
        first, second, third = (job.id for job in other.jobs(**question).items)
        store.command(first, Command.CANCEL)

        def removed_before(connection: Connection, ids: Sequence[str]) -> Any:
            if first in ids:
                other.delete_job(first)
            return read_long(connection, ids)

        monkeypatch.setattr(job_list, "read_long", removed_before)
        page = store.jobs(**question, limit=1)
    assert [job.id for job in page.items] == [second]
    assert [job.id for job in store.jobs(**question, after=page.next).items] == [third]
