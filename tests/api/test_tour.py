"""The README's tour over REST, call by call as it is printed."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import httpx2
import pytest

from tests.examples.servers import ServerProcess
from tests.setup.documents import calls, section

ADDRESS = "http://127.0.0.1:8000"


@pytest.fixture
def server(tmp_path: Path) -> Iterator[ServerProcess]:
    started = ServerProcess(tmp_path / "jobs.db")
    yield started
    started.close()


def sent(server: ServerProcess, words: list[str], job_id: str) -> httpx2.Response:
    """What a call of curl sends, to this server and this job, with fewer iterations."""
    method, headers, content, url = "GET", {}, None, ""
    rest = iter(words)
    for word in rest:
        if word == "-X":
            method = next(rest)
        elif word == "-H":
            name, value = next(rest).split(": ")
            headers[name] = value
        elif word == "-d":
            content = next(rest).replace('"iterations": 25', '"iterations": 3')
        elif word not in ("-s", "-N"):
            assert word.startswith(ADDRESS), f"what is {word}?"
            url = word.removeprefix(ADDRESS).replace("ID", job_id)
    return server.client.request(method, url, headers=headers, content=content)


@pytest.mark.slow
def test_the_readmes_tour_over_rest_does_what_it_says(server: ServerProcess) -> None:
    job_id, answers = "", {}
    for words in calls(section("Two minutes over REST"), "curl"):
        answer = sent(server, words, job_id)
        assert answer.status_code < 300, (words, answer.text)
        asked = re.sub(f"^.*/v1/|{job_id or None}/", "", str(answer.request.url))
        answers[f"{answer.request.method} {asked}"] = answer
        if asked == "jobs":
            job_id = answer.json()["id"]

    assert "fuzzy-pi" in answers["GET controllers"].text
    assert answers["POST jobs/pause"].json()["state"] in ("pausing", "paused")
    assert answers["POST jobs/resume"].json()["state"] in ("queued", "running")
    assert '"evaluations":75' in answers["GET jobs/events"].text.split("event: state")[-1]
    assert server.job(job_id)["state"] == "succeeded"
    assert set(answers["GET jobs/best"].json()["design"]) >= {"I", "FOR"}
    assert list(answers["POST simulations"].json()["scenarios"]) == ["turn-right-fast"]
