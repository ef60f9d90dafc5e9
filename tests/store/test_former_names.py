"""What was stored when fields had other names is read as if it had been stored today."""

from __future__ import annotations

import json
from typing import Any

from sqlalchemy import Table, select, update

from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.store.connections.engine import connect, parse_url
from gaitswarm.services.optimizer.store.rows.tables import jobs, recordings
from gaitswarm.services.optimizer.store.sql_store import SqlStore, open_store
from tests.examples.walks import SHORT_WALK
from tests.store.test_recordings import recording

SPEC: dict[str, Any] = {
    "controller": "pi",
    "robot": {"backlash": [2.5, 1.0, 1.0]},
    "scenarios": [SHORT_WALK],
    "optimizer": {"particles": 2},
    "iterations": 3,
}


def with_former_names(url: str, table: Table, column: str) -> None:
    """Let the only row of a table have the names that documents were stored with before."""
    database = connect(parse_url(url))
    with database.transaction(write=True) as connection:
        document = json.dumps(connection.execute(select(table.c[column])).scalar_one())
        assert "hip_height" in document
        for name, former in (("hip_height", "withers"), ("backlash", "gearlash")):
            document = document.replace(f'"{name}"', f'"{former}"')
        connection.execute(update(table).values({column: json.loads(document)}))
    database.close()


def test_a_job_stored_under_former_names_is_the_same_job(
    database_url: str,
) -> None:
    store = open_store(database_url)
    job, _ = store.create_job(JobSpec.model_validate(SPEC), idempotency_key="key")
    with_former_names(database_url, jobs, "spec")
    assert store.job(job.id) == job
    assert [listed.id for listed in store.jobs().items] == [job.id]
    again, new = store.create_job(JobSpec.model_validate(SPEC), idempotency_key="key")
    assert not new
    assert again == job
    claim = store.claim("runner", lease_seconds=10.0)
    assert claim is not None
    assert claim.job.spec == job.spec
    store.close()


def test_a_recording_stored_under_former_names_is_the_same_walk(database_url: str) -> None:
    store: SqlStore = open_store(database_url)
    name = store.add_recording(recording())
    with_former_names(database_url, recordings, "document")
    assert store.recordings([name])[name] == recording()
    store.close()
