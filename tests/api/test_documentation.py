"""/docs teaches the domain: every route and every field is explained."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import httpx2
import pytest

from gaitswarm.api.documentation import TAGS
from tests.examples.api_document import api_document

Document = dict[str, Any]
Operation = tuple[str, Document]


@pytest.fixture(scope="module")
def document() -> Document:
    return api_document()


def operations(document: Document) -> Iterator[Operation]:
    for path, methods in document["paths"].items():
        for method, operation in methods.items():
            yield f"{method} {path}", operation


def test_the_routes_are_these(document: Document) -> None:
    job = "/v1/jobs/{job_id}"

    assert {name for name, _ in operations(document)} == {
        "get /v1/robots/{digest}/meshes",
        "get /v1/robots/{digest}/meshes/{number}",
        "post /v1/jobs",
        "get /v1/jobs",
        f"get {job}",
        f"post {job}/pause",
        f"post {job}/resume",
        f"post {job}/extend",
        f"post {job}/fork",
        f"post {job}/cancel",
        f"delete {job}",
        f"post {job}/restore",
        f"put {job}/priority",
        f"put {job}/keep",
        f"delete {job}/keep",
        f"get {job}/notifications",
        f"get {job}/iterations",
        f"get {job}/iterations/{{iteration}}/evaluations",
        f"get {job}/best",
        f"get {job}/events",
        f"get {job}/export",
        f"get {job}/evidence",
        f"post {job}/verify",
        f"get {job}/distribution",
        f"get {job}/particles",
        f"post {job}/ranking",
        f"get {job}/failures",
        f"get {job}/preferences",
        f"get {job}/firmware",
        f"get {job}/firmware/summary",
        f"get {job}/trajectories",
        f"post {job}/front",
        f"get {job}/preference-for",
        f"get {job}/parameters",
        f"get {job}/targets",
        f"get {job}/certificate",
        "post /v1/estimates",
        "get /v1/recordings",
        "post /v1/recordings",
        "post /v1/measured-walks",
        "get /v1/recordings/{recording_id}",
        "get /v1/recordings/{recording_id}/summary",
        "post /v1/simulations",
        "post /v1/replays",
        "post /v1/robustness",
        "patch /v1/jobs/{job_id}",
        "get /v1/job-facets",
        "get /v1/job-convergences",
        "get /v1/jobs/{job_id}/comparison",
        "get /v1/jobs/{job_id}/verdict",
        "get /v1/jobs/{job_id}/activity",
        "get /v1/jobs/{job_id}/importance",
        "get /v1/robots",
        "post /v1/robots/drafts",
        "post /v1/robots/checks",
        "get /v1/scenarios",
        "get /v1/preferences",
        "get /v1/optimizers",
        "get /v1/controllers",
        "get /v1/cases",
        "post /v1/controllers/{controller}/surface",
        "get /v1/audit",
        "get /v1/session",
        "post /v1/session",
        "delete /v1/session",
        "get /v1/healthz",
        "get /v1/readyz",
    }


def test_every_route_has_a_summary_a_description_a_tag_and_a_short_id(document: Document) -> None:
    tags = {tag["name"] for tag in TAGS}
    ids = [operation["operationId"] for _, operation in operations(document)]

    assert len(set(ids)) == len(ids)
    for name, operation in operations(document):
        assert operation["summary"], name
        assert len(operation["description"]) > 30, name
        assert len(operation["tags"]) == 1 and set(operation["tags"]) <= tags, name
        assert operation["operationId"].isidentifier(), name


def test_the_core_comes_first_and_what_the_page_alone_uses_is_marked(document: Document) -> None:
    named = [(operation["tags"], operation["operationId"]) for _, operation in operations(document)]
    assert TAGS[0]["name"] == "core"
    assert {name for tags, name in named if tags == ["core"]} == {
        *("submit_job", "list_jobs", "get_job", "pause_job", "resume_job", "cancel_job"),
        *("extend_job", "list_iterations", "get_best", "stream_events"),
    }
    assert next(iter(document["paths"])) == "/v1/jobs"
    for name, operation in operations(document):
        for_page = "For the web page" in operation["description"]
        assert (operation.get("x-used-by") == "page") is for_page, name


def test_every_parameter_is_described(document: Document) -> None:
    for name, operation in operations(document):
        for parameter in operation.get("parameters", []):
            assert parameter.get("description"), f"{name}: {parameter['name']}"


def test_every_schema_and_every_field_is_described(document: Document) -> None:
    undescribed = []
    for name, schema in document["components"]["schemas"].items():
        undescribed += [] if schema.get("description") else [name]
        for field, value in schema.get("properties", {}).items():
            described = value.get("description") or "const" in value
            undescribed += [] if described else [f"{name}.{field}"]

    assert undescribed == []


def test_every_error_is_a_problem(document: Document) -> None:
    for name, operation in operations(document):
        errors = {s: r for s, r in operation["responses"].items() if s >= "400"}
        assert {"500", "503"} <= set(errors), name
        for status, response in errors.items():
            content = response["content"]
            assert set(content) == {"application/problem+json"}, f"{name} {status}"
            reference = content["application/problem+json"]["schema"]["$ref"]
            assert reference.endswith("/ProblemView"), f"{name} {status}"


def test_a_job_spec_is_one_schema_for_requests_and_answers(document: Document) -> None:
    schemas = document["components"]["schemas"]

    named = ("Job", "Identification", "Calibration", "Certificate", "Preferences")
    kinds = [f"{kind}Spec" for kind in named]
    assert not [name for name in schemas if name.startswith(tuple(f"{kind}-" for kind in kinds))]
    spec, null = schemas["JobView"]["properties"]["spec"]["anyOf"]
    answered = spec["oneOf"]
    asked = document["paths"]["/v1/jobs"]["post"]["requestBody"]["content"]["application/json"]
    assert [kind["$ref"].rpartition("/")[2] for kind in answered] == kinds
    assert asked["schema"]["oneOf"] == answered
    assert null == {"type": "null"}
    assert schemas["JobSpec"]["examples"]


def test_the_event_stream_is_declared_as_one(document: Document) -> None:
    answer = document["paths"]["/v1/jobs/{job_id}/events"]["get"]["responses"]["200"]

    assert "event: iteration" in answer["content"]["text/event-stream"]["example"]


def test_the_page_needs_no_other_host(client: httpx2.Client) -> None:
    page = client.get("/docs")

    assert page.status_code == 200
    assert "http://" not in page.text
    assert "https://" not in page.text
    for asset in ("swagger-ui-bundle.js", "swagger-ui.css"):
        assert f"/docs-assets/{asset}" in page.text
        assert client.get(f"/docs-assets/{asset}").status_code == 200


def test_every_operation_that_is_counted_may_say_that_there_are_too_many(
    document: Document,
) -> None:
    silent = {
        operation["operationId"]
        for _, operation in operations(document)
        if "429" not in operation["responses"]
    }
    assert silent == {"healthz", "readyz"}
