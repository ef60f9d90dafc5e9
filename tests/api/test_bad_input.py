"""Bad input: each a clear problem that names the field, and nothing left written."""

from __future__ import annotations

import json
import socket
from collections.abc import Iterator
from typing import Any

import httpx2
import pytest

from gaitswarm.services.optimizer.store import Store

pytestmark = pytest.mark.slow

GOOD: dict[str, Any] = {"scenarios": ["normal-fast"], "iterations": 2}
OWN = {"name": "own", "cycle_time": 1.5, "radius": 0.16, "hip_height": 0.15}
BIASES = [1.0, 1.0, 1.0, 1.0, 1.0]


def refused(answer: httpx2.Response, status: int) -> dict[str, Any]:
    """The problem, checked for what every problem has."""
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    problem: dict[str, Any] = answer.json()
    assert problem["status"] == status
    assert problem["type"].startswith("urn:gaitswarm:problem:")
    assert problem["title"]
    assert problem["detail"]
    assert problem["instance"] == answer.request.url.path
    return problem


@pytest.fixture(autouse=True)
def nothing_is_written(store: Store) -> Iterator[None]:
    yield
    assert store.jobs().items == ()


@pytest.mark.parametrize(
    ("change", "field", "hint"),
    [
        ({"scenarios": ["on-the-moon"]}, "scenarios.0", "known are"),
        ({"scenarios": ["1", "99"]}, "scenarios.1", "unknown scenario '99'"),
        ({"scenarios": []}, "scenarios", "at least 1"),
        ({"scenarios": ["1", "normal-fast"]}, "scenarios", "named twice"),
        ({"scenarios": [{**OWN, "cycle_time": 0.0}]}, "scenarios.0.cycle_time", "0.2"),
        ({"scenarios": [{**OWN, "wheels": 4}]}, "scenarios.0.wheels", "unknown key"),
        ({"scenarios": [{"name": "own"}]}, "scenarios.0.radius", "is missing"),
        ({"scenarios": [{**OWN, "stride": 0.9}]}, "scenarios.0", "misses its foot trajectory"),
        ({"variables": [{"name": "FI1R", "low": 6000, "high": 1500}]}, "variables.0", "inverted"),
        ({"variables": ["FI1R"]}, "variables", "neither searched nor fixed"),
        ({"variables": ["warp"]}, "variables", "unknown variable"),
        ({"fixed": {"warp": 9}}, "fixed", "unknown variable"),
        ({"controller": "telepathy"}, "controller", "fuzzy-pi"),
        ({"robot": "octopus"}, "robot", "szabadka2"),
        ({"preference": "Z"}, "preference", "'A', 'B', 'C' or 'chapter-3'"),
        (
            {"preference": {"bias": BIASES, "exponent": [0.0] * 5}},
            "preference",
            "exponents are zero",
        ),
        ({"iterations": 0}, "iterations", "at least 1"),
        ({"iterations": 2.5}, "iterations", "whole number"),
        ({"optimizer": {"particles": 0}}, "optimizer.particles", "at least 1"),
        ({"seed": -1}, "seed", "at least 0"),
        ({"budget": 1}, "budget", "unknown key; known are"),
    ],
)
def test_a_spec_that_makes_no_sense_is_refused_by_field(
    client: httpx2.Client, change: dict[str, Any], field: str, hint: str
) -> None:
    problem = refused(client.post("/v1/jobs", json={**GOOD, **change}), 422)

    assert field in [error["field"] for error in problem["errors"]]
    assert hint in problem["detail"]


@pytest.mark.parametrize("literal", ["NaN", "Infinity", "-Infinity", "1e999"])
@pytest.mark.parametrize(
    ("template", "field"),
    [
        ('{"fixed": {"FI1R": %s}}', "fixed.FI1R"),
        ('{"variables": [{"name": "FI1R", "low": %s, "high": 2}]}', "variables.0.low"),
        ('{"optimizer": {"social": %s}}', "optimizer.social"),
        ('{"iterations": %s}', "iterations"),
        ('{"scenarios": [{"name": "own", "radius": %s}]}', "scenarios.0.radius"),
    ],
)
def test_numbers_that_are_not_finite_are_refused_by_field(
    client: httpx2.Client, template: str, field: str, literal: str
) -> None:
    answer = client.post(
        "/v1/jobs", content=template % literal, headers={"Content-Type": "application/json"}
    )

    problem = refused(answer, 422)
    assert field in [error["field"] for error in problem["errors"]]


def test_a_spec_wrong_in_a_thousand_places_gets_a_short_answer(client: httpx2.Client) -> None:
    spec = {**GOOD, "fixed": {f"not a name {k}": 1.0 for k in range(1000)}}

    problem = refused(client.post("/v1/jobs", json=spec), 422)

    assert len(problem["errors"]) <= 20
    assert problem["detail"].endswith("980 more")


@pytest.mark.parametrize("body", ["{", '{"seed": 1,}', "\x00", '{"seed": 1} {}', "[" * 100_000])
def test_a_body_that_is_not_json_is_refused(client: httpx2.Client, body: str) -> None:
    answer = client.post("/v1/jobs", content=body, headers={"Content-Type": "application/json"})

    problem = refused(answer, 400)
    assert problem["type"] == "urn:gaitswarm:problem:malformed-json"


@pytest.mark.parametrize("body", ['{"name": "a", "name": "b"}', '{"fixed": {"S1": 1, "S1": 2}}'])
def test_a_name_twice_in_an_object_is_refused(client: httpx2.Client, body: str) -> None:
    answer = client.post("/v1/jobs", content=body, headers={"Content-Type": "application/json"})

    assert "occurs twice in one object" in refused(answer, 400)["detail"]


@pytest.mark.parametrize(
    ("document", "field"),
    [
        ({"seed": True}, "seed"),
        ({"fixed": {"FI1R": True}}, "fixed.FI1R"),
        ({"optimizer": {"name": "pso", "cognitive": True}}, "optimizer.cognitive"),
        ({"scenarios": [{**OWN, "cycle_time": True}]}, "scenarios.0.cycle_time"),
    ],
)
def test_true_and_false_are_no_numbers(
    client: httpx2.Client, document: dict[str, Any], field: str
) -> None:
    (error,) = refused(client.post("/v1/jobs", json=document), 422)["errors"]

    assert error == {"field": field, "message": "must be a number"}


def test_a_request_with_two_lengths_is_the_last_of_its_connection(client: httpx2.Client) -> None:
    url = client.base_url
    lengths = b"Content-Length: 5\r\nTransfer-Encoding: chunked"
    request = b"POST /v1/estimates HTTP/1.1\r\nHost: localhost\r\n" + lengths
    with socket.create_connection((url.host, url.port or 80), timeout=10.0) as connection:
        connection.sendall(request + b"\r\n\r\n0\r\n\r\n")
        answer = b"".join(iter(lambda: connection.recv(65536), b""))

    assert answer.startswith(b"HTTP/1.1 ") and b"\r\nconnection: close\r\n" in answer


@pytest.mark.parametrize("body", ["[]", '"job"', "3", "null"])
def test_a_body_that_is_no_object_is_refused(client: httpx2.Client, body: str) -> None:
    answer = client.post("/v1/jobs", content=body, headers={"Content-Type": "application/json"})

    problem = refused(answer, 422)
    assert problem["errors"][0]["field"] == "body"


def test_a_missing_body_is_refused(client: httpx2.Client) -> None:
    problem = refused(client.post("/v1/jobs"), 422)

    assert "application/json" in problem["detail"]


def test_a_body_of_another_media_type_is_refused(client: httpx2.Client) -> None:
    refused(client.post("/v1/jobs", content="seed=1", headers={"Content-Type": "text/plain"}), 422)


def test_a_spec_of_ten_megabytes_is_refused(client: httpx2.Client) -> None:
    body = json.dumps({**GOOD, "name": "x" * 10_000_000})

    answer = client.post("/v1/jobs", content=body, headers={"Content-Type": "application/json"})

    problem = refused(answer, 413)
    assert problem["type"] == "urn:gaitswarm:problem:body-too-large"


def test_a_spec_of_ten_megabytes_in_chunks_is_refused(client: httpx2.Client) -> None:
    def chunks() -> Iterator[bytes]:
        yield b'{"name": "'
        for _ in range(160):
            yield b"x" * 65_536
        yield b'"}'

    answer = client.post("/v1/jobs", content=chunks(), headers={"Content-Type": "application/json"})

    refused(answer, 413)


@pytest.mark.parametrize("key", ["", "two words", "x" * 201])
def test_an_unusable_idempotency_key_is_refused(client: httpx2.Client, key: str) -> None:
    problem = refused(client.post("/v1/jobs", json=GOOD, headers={"Idempotency-Key": key}), 422)

    assert problem["errors"][0]["field"] == "Idempotency-Key"


@pytest.mark.parametrize(
    ("query", "field"),
    [
        ({"limit": "0"}, "limit"),
        ({"limit": "all"}, "limit"),
        ({"state": "asleep"}, "state"),
        ({"after": "yesterday"}, "after"),
    ],
)
def test_an_impossible_question_about_jobs_is_refused_by_field(
    client: httpx2.Client, query: dict[str, str], field: str
) -> None:
    problem = refused(client.get("/v1/jobs", params=query), 422)

    assert problem["errors"][0]["field"] == field


@pytest.mark.parametrize("method", ["GET", "POST"])
def test_an_unknown_path_is_a_problem(client: httpx2.Client, method: str) -> None:
    problem = refused(client.request(method, "/v1/robot-wars"), 404)

    assert "/docs" in problem["detail"]


@pytest.mark.parametrize(
    ("path", "allowed"),
    [
        ("/v1/jobs", "GET, POST"),
        ("/v1/jobs/bcdfghjkmnpq/pause", "POST"),
        ("/v1/scenarios", "GET"),
        ("/healthz", "GET, HEAD"),
    ],
)
def test_a_method_that_a_path_does_not_have_is_a_problem_that_names_those_it_has(
    client: httpx2.Client, path: str, allowed: str
) -> None:
    answer = client.delete(path)

    refused(answer, 405)
    assert answer.headers["Allow"] == allowed
