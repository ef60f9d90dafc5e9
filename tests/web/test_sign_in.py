"""Sign-in by form, and by the link of `gaitswarm serve`."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import expect

from gaitswarm.services.optimizer.access import Scope
from gaitswarm.services.optimizer.store import Store
from tests.examples.servers import Server
from tests.web.visit import Visit

REFUSED = r"401 \(Unauthorized\)"


@pytest.fixture
def secret(store: Store) -> str:
    """Secret of a token in the database of `start_server`."""
    return store.tokens.create("reader", Scope.READ)[1]


@pytest.fixture
def guarded(start_server: Callable[..., Server]) -> Server:
    return start_server(api_access="token")


def test_the_page_asks_for_a_token(
    guarded: Server, secret: str, visit: Callable[..., Visit]
) -> None:
    page = visit(guarded.url, allowed=REFUSED).go("/jobs")
    expect(page.get_by_role("heading", name="Sign in")).to_be_visible()
    page.get_by_label("Token").fill("guessed")
    page.get_by_role("button", name="Sign in").click()
    expect(page.get_by_role("alert")).to_contain_text("unknown or was revoked")
    page.get_by_label("Token").fill(f" {secret} ")
    page.get_by_role("button", name="Sign in").click()
    expect(page.get_by_role("heading", name="Sign in")).to_be_hidden()
    expect(page.get_by_role("heading", name="Jobs", exact=True)).to_be_visible()
    page.reload()
    expect(page.get_by_role("heading", name="Jobs", exact=True)).to_be_visible()


def test_the_link_signs_in_and_does_not_reveal_the_token(
    guarded: Server, secret: str, visit: Callable[..., Visit]
) -> None:
    visited = visit(guarded.url)
    page = visited.go(f"/#token={secret}")
    expect(page.get_by_role("heading", name="Jobs", exact=True)).to_be_visible()
    assert secret not in page.url
    assert not [url for url in visited.requested if secret in url]
    assert secret not in page.evaluate("document.cookie")
