"""A token is sent only to its own server, and only over encrypted connections."""

from __future__ import annotations

import pytest

import gaitswarm
from gaitswarm.jobs.open import with_token
from gaitswarm.settings import Settings

OWN = "https://robots.example"
BEARER = {"Authorization": "Bearer secret"}


@pytest.mark.parametrize(
    "url",
    [
        f"{OWN}:8443/gaitswarm",
        "http://127.0.0.1:8000",
        "http://localhost:8000",
        "http://[::1]:8000",
    ],
)
def test_a_token_is_sent_by_https_and_within_this_machine(url: str) -> None:
    assert with_token(url, None, "secret", Settings()) == BEARER
    assert with_token(url, None, None, Settings(token="secret")) == BEARER
    assert with_token(url, None, None, Settings()) == {}


@pytest.mark.parametrize(
    "url", ["http://robots.example", "http://192.168.1.7:8000", "http://127.0.0.1.evil.example"]
)
def test_a_token_does_not_leave_this_machine_as_plain_text(url: str) -> None:
    for token, settings in (("secret", Settings()), (None, Settings(token="secret"))):
        with pytest.raises(gaitswarm.InvalidRequest, match=r"https://.*GAITSWARM_TOKEN_OVER_HTTP"):
            with_token(url, None, token, settings)
    assert with_token(url, None, None, Settings()) == {}


def test_unless_its_owner_trusts_the_network() -> None:
    trusting = Settings(token="secret", token_over_http=True)
    assert with_token("http://api:8000", None, None, trusting) == BEARER


@pytest.mark.parametrize("url", [OWN, f"{OWN}/", f"{OWN}:443", "https://Robots.Example/path"])
def test_the_token_of_the_environment_goes_to_its_server(url: str) -> None:
    assert with_token(url, None, None, Settings(server=OWN, token="secret")) == BEARER


@pytest.mark.parametrize(
    "url", ["https://elsewhere.example", f"{OWN}:8443", "http://robots.example", "http://localhost"]
)
def test_and_to_no_other_one(url: str) -> None:
    assert with_token(url, None, None, Settings(server=OWN, token="secret")) == {}


def test_a_header_of_its_own_goes_before_the_token() -> None:
    headers = {"authorization": "Basic x"}
    assert with_token(OWN, headers, "secret", Settings()) == headers


@pytest.mark.parametrize(
    "url", ["robots.example", "ftp://robots.example", "http://x:99999", "https://"]
)
def test_what_is_no_url_is_sent_nothing(url: str) -> None:
    with pytest.raises(gaitswarm.InvalidRequest, match="not a URL"):
        gaitswarm.connect(url, token="secret")


def test_a_command_refuses_before_anything_is_sent(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GAITSWARM_TOKEN", "secret")
    with pytest.raises(gaitswarm.InvalidRequest, match="plain text"):
        gaitswarm.connect("http://robots.example")
