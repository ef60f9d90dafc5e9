"""The manual, served as it was built."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.examples.servers import Server

SCRIPT = "document.documentElement.dataset.mode = 'light'"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path / "manual"


@pytest.fixture
def server(folder: Path) -> Iterator[Server]:
    started = Server(None, manual_folder=folder)
    yield started
    started.close()


def built(folder: Path) -> None:
    (folder / "docs").mkdir(parents=True)
    (folder.parent / "secret.html").write_text("not for readers", encoding="utf-8")
    page = f'<script src="a.js"></script><script data-cf="no">{SCRIPT}</script>'
    (folder / "docs" / "index.html").write_text(page, encoding="utf-8")
    (folder / "a.js").write_text("1", encoding="utf-8")


@pytest.mark.parametrize("path", ["/manual", "/manual/", "/manual/docs/cli.html"])
def test_a_missing_manual_is_a_problem_that_says_how_to_build_it(server: Server, path: str) -> None:
    answer = server.client.get(path)
    assert answer.status_code == 404
    assert answer.headers["content-type"] == "application/problem+json"
    assert "make manual" in answer.json()["detail"] and "docs/index.md" in answer.json()["detail"]
    assert server.client.get("/v1/session").json()["manual"] is False


def test_its_first_page_is_at_manual_and_its_own_inline_scripts_alone_may_run(
    server: Server, folder: Path
) -> None:
    built(folder)
    answer = server.client.get("/manual", follow_redirects=True)
    digest = base64.b64encode(hashlib.sha256(SCRIPT.encode()).digest()).decode()
    assert answer.headers["content-type"].startswith("text/html")
    assert f"script-src 'self' 'sha256-{digest}';" in answer.headers["content-security-policy"]
    assert server.client.get("/v1/session").json()["manual"] is True


def test_other_files_have_their_types(server: Server, folder: Path) -> None:
    built(folder)
    assert "javascript" in server.client.get("/manual/a.js").headers["content-type"]


@pytest.mark.parametrize("path", ["../secret.html", "%2e%2e/secret.html", "docs", "no.html"])
def test_nothing_but_its_files_is_served(server: Server, folder: Path, path: str) -> None:
    built(folder)
    answer = server.client.get(f"/manual/{path}")
    assert answer.status_code == 404
    assert "not for readers" not in answer.text
