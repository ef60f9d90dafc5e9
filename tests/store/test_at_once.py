"""Reads that do not wait: the same as others, or none."""

from __future__ import annotations

from pathlib import Path

from gaitswarm.services.optimizer.jobs.labels import LabelsChange
from gaitswarm.services.optimizer.store.sql_store import open_store
from tests.store.examples import spec


def test_a_job_is_read_at_once_as_it_was_committed_last(database_url: str) -> None:
    store, other = open_store(database_url), open_store(database_url)
    job = store.create_job(spec())[0]
    told = store.at_once.job(job.id)
    if not database_url.startswith("sqlite"):
        assert told is None and store.at_once.version() is None
    else:
        assert told is store.job(job.id)
        for changing in (store, other):
            changing.label(job.id, LabelsChange(note=f"by {id(changing)}"))
            changed = store.at_once.job(job.id)
            assert changed is store.job(job.id) and changed is not told
            told = changed
        assert store.at_once.job("b" * 12) is None is store.at_once.job("no job")
    store.close()
    assert store.at_once.job(job.id) is None is store.at_once.version()
    other.close()


def test_the_version_is_another_after_every_commit_and_only_then(database: Path) -> None:
    store, other = open_store(str(database)), open_store(str(database))
    versions = [store.at_once.version()]
    for changing in (store, other, store):
        job = changing.create_job(spec())[0]
        versions.append(store.at_once.version())
        assert store.job(job.id) and store.at_once.version() == versions[-1]
    assert len(set(versions)) == 4 and None not in versions
    store.close()
    other.close()


def test_a_file_that_cannot_be_read_is_read_again_when_it_can(database: Path) -> None:
    store = open_store(str(database))
    job = store.create_job(spec())[0]
    away = database.rename(database.with_suffix(".away"))
    assert store.at_once.job(job.id) is None is store.at_once.version()
    away.rename(database)
    assert store.at_once.job(job.id) == job
    assert store.at_once.version() is not None
    store.close()
