"""Tokens: made once, found by their secret alone, and worth nothing once they are revoked."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from contextlib import closing

import pytest
from sqlalchemy import text

from gaitswarm.services.optimizer.access import Scope, Token
from gaitswarm.services.optimizer.errors import InvalidRequest, NotFound
from gaitswarm.services.optimizer.store import Store, open_store
from gaitswarm.services.optimizer.store.engine import Database
from tests.store.examples import Clock, spec


def test_a_token_is_found_by_its_secret(store: Store, clock: Clock) -> None:
    made, secret = store.tokens.create("ci", Scope.SUBMIT)
    assert made == Token("ci", Scope.SUBMIT, clock.now)
    assert store.tokens.find(secret) == made
    assert store.tokens.find(secret + "x") is None
    assert store.tokens.find("") is None


def test_secrets_are_stored_nowhere(store: Store, database_url: str) -> None:
    _, secret = store.tokens.create("ci", Scope.READ)
    database = Database(database_url)
    with closing(database), database.read() as connection:
        rows = connection.execute(text("SELECT * FROM tokens")).all()
    assert len(rows) == 1
    assert secret.removeprefix("gaitswarm_") not in repr(rows)


def test_a_revoked_token_is_found_no_more_but_listed(store: Store, clock: Clock) -> None:
    _, secret = store.tokens.create("ci", Scope.ADMIN)
    clock.advance(60.0)
    revoked = store.tokens.revoke("ci")
    assert revoked.revoked_at == clock.now
    assert store.tokens.find(secret) is None
    assert store.tokens.all() == (revoked,)
    clock.advance(60.0)
    assert store.tokens.revoke("ci") == revoked


def test_a_name_is_given_once_for_the_owner_of_a_job_stays_who_it_was(store: Store) -> None:
    store.tokens.create("ci", Scope.SUBMIT)
    store.tokens.revoke("ci")
    with pytest.raises(InvalidRequest, match="name: there is a token 'ci' already"):
        store.tokens.create("ci", Scope.READ)


@pytest.mark.parametrize("name", ["", "a b", "x" * 65, "naïve", "a/b", "a\n"])
def test_a_name_that_is_invalid_is_refused(store: Store, name: str) -> None:
    with pytest.raises(InvalidRequest, match="letters, digits"):
        store.tokens.create(name, Scope.READ)


def test_there_is_no_token_of_an_unknown_name(store: Store) -> None:
    with pytest.raises(NotFound, match="'unknown'"):
        store.tokens.revoke("unknown")


def test_of_many_servers_that_start_at_once_one_makes_the_first_token(database_url: str) -> None:
    def start(_: int) -> str | None:
        with closing(open_store(database_url)) as store:
            return store.tokens.create_first()

    with ThreadPoolExecutor(4) as pool:
        secrets = [secret for secret in pool.map(start, range(4)) if secret is not None]
    assert len(secrets) == 1
    with closing(open_store(database_url)) as store:
        found = store.tokens.find(secrets[0])
        assert found is not None and found.scope is Scope.ADMIN
        store.tokens.revoke(found.name)
        # After all tokens were revoked, the next start must not print a new one.
        assert store.tokens.create_first() is None


def test_a_job_keeps_its_owner(store: Store) -> None:
    job, _ = store.create_job(spec(), owner="ci")
    assert store.job(job.id).owner == "ci"
    assert store.create_job(spec())[0].owner is None


@pytest.mark.parametrize("scope", Scope)
def test_scopes_allow_what_those_before_them_do(scope: Scope) -> None:
    allowed = {needed for needed in Scope if scope.allows(needed)}
    assert (
        allowed
        == {
            Scope.READ: {Scope.READ},
            Scope.SUBMIT: {Scope.READ, Scope.SUBMIT},
            Scope.ADMIN: set(Scope),
        }[scope]
    )
