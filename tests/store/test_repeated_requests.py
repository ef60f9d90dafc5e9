"""Requests that are repeated with their idempotency key, by the same gaitswarm or a newer one."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from sqlalchemy import text

from gaitswarm.services.optimizer.errors import IdempotencyConflict
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.preference import PREFERENCES
from gaitswarm.services.optimizer.store import Store
from gaitswarm.services.optimizer.store.engine import Database
from gaitswarm.sim import scenario
from gaitswarm.sim.scenario import Scenario, find_scenario

REQUEST = {"controller": "pi", "scenarios": ["1", "2"], "preference": "A"}


def asked(**changes: object) -> JobSpec:
    return JobSpec.model_validate(REQUEST | changes)


def another_preference(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(PREFERENCES, "A", PREFERENCES["B"])


def another_scenario(monkeypatch: pytest.MonkeyPatch) -> None:
    def steeper(name: str) -> Scenario:
        return find_scenario(name).model_copy(update={"slope": 3.0})

    monkeypatch.setattr(scenario, "find_scenario", steeper)


@pytest.mark.parametrize("change", [another_preference, another_scenario], ids=lambda f: f.__name__)
def test_a_request_is_the_same_when_the_presets_that_it_names_have_changed(
    store: Store, monkeypatch: pytest.MonkeyPatch, change: Callable[[pytest.MonkeyPatch], None]
) -> None:
    first, _ = store.create_job(asked(), idempotency_key="k")
    change(monkeypatch)
    assert asked().resolved() != first.spec
    assert store.create_job(asked(), idempotency_key="k") == (first, False)
    with pytest.raises(IdempotencyConflict, match=first.id):
        store.create_job(asked(seed=5), idempotency_key="k")


def test_a_request_is_recognized_by_the_document_that_was_sent_whatever_its_layout(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, _ = store.create_job(asked(), idempotency_key="k", request={"a": 1, "b": [2.5]})
    another_preference(monkeypatch)
    again = store.create_job(asked(), idempotency_key="k", request={"b": [2.5], "a": 1})
    assert again == (first, False)
    with pytest.raises(IdempotencyConflict):
        store.create_job(asked(), idempotency_key="k", request={"a": 1, "b": [2.6]})


def test_a_request_that_spells_the_same_job_differently_is_the_same(store: Store) -> None:
    first, _ = store.create_job(asked(), idempotency_key="k")
    spelled_out = asked(scenarios=["normal-fast", "normal-slow"], seed=1)
    assert store.create_job(spelled_out, idempotency_key="k") == (first, False)


def test_a_job_whose_request_was_not_stored_is_recognized_by_its_spec(
    store: Store, database_url: str
) -> None:
    first, _ = store.create_job(asked(), idempotency_key="k")
    database = Database(database_url)
    with database.write() as connection:
        connection.execute(text("UPDATE jobs SET request_digest = NULL"))
    database.close()
    assert store.create_job(asked(), idempotency_key="k") == (first, False)
    with pytest.raises(IdempotencyConflict, match="new key"):
        store.create_job(asked(seed=5), idempotency_key="k")
