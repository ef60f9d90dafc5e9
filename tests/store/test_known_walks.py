"""Stored results of designs, by key."""

from __future__ import annotations

import numpy as np
import pytest
from sqlalchemy import text

from gaitswarm.services.optimizer.store import Store
from gaitswarm.services.optimizer.store.engine import Database
from gaitswarm.sim.outcome import Status
from tests.store.examples import begun, completed

KEYS = (b"\0" * 16, b"\xff" * 16)


def test_an_outcome_is_found_by_its_key_to_the_bit(store: Store) -> None:
    done = completed(0, (2.0, np.inf))._replace(keys=KEYS)
    store.commit(begun(store, iterations=1), done, None)
    found = store.known([*KEYS, b"another key yet"])
    assert set(found) == set(KEYS)
    for particle, key in enumerate(KEYS):
        for case, outcome in enumerate(done.outcomes):
            assert found[key].objectives[case].tobytes() == outcome.objectives[particle].tobytes()
            assert found[key].statuses[case] == outcome.statuses[particle]
    assert found[KEYS[1]].statuses.tolist() == [Status.OK, Status.FELL]


def test_what_was_not_walked_has_no_key_and_is_counted(store: Store) -> None:
    claim = begun(store, iterations=1)
    store.commit(claim, completed(0)._replace(keys=(KEYS[0], None)), None)
    assert set(store.known(KEYS)) == {KEYS[0]}
    progress = store.job(claim.job.id).progress
    assert (progress.evaluations, progress.evaluations_saved) == (2, 1)
    assert progress.evaluations_walked == 1


def test_an_iteration_without_keys_is_not_found_and_saves_nothing(store: Store) -> None:
    claim = begun(store, iterations=1)
    store.commit(claim, completed(0), None)
    assert store.known(KEYS) == {}
    assert store.job(claim.job.id).progress.evaluations_saved == 0


def test_many_keys_are_asked_for_at_once(store: Store) -> None:
    store.commit(begun(store, iterations=1), completed(0)._replace(keys=KEYS), None)
    others = [number.to_bytes(16, "big") for number in range(1, 3000)]
    assert set(store.known([*others, KEYS[1], *others])) == {KEYS[1]}


@pytest.mark.parametrize("statuses", [b"", bytes([9, Status.OK])], ids=["missing", "unknown"])
def test_a_damaged_outcome_is_not_known(store: Store, database_url: str, statuses: bytes) -> None:
    store.commit(begun(store, iterations=1), completed(0)._replace(keys=KEYS), None)
    database = Database(database_url)
    with database.write() as connection:
        damage = text("UPDATE evaluations SET statuses = :statuses WHERE particle = 0")
        connection.execute(damage, {"statuses": statuses})
    database.close()
    assert set(store.known(KEYS)) == {KEYS[1]}
