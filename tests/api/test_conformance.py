"""The server keeps to its own OpenAPI document, whatever it is sent."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from typing import Any, cast

import pytest
import schemathesis
from fastapi.routing import APIRoute
from hypothesis import HealthCheck, Phase, settings
from requests import Session
from schemathesis.core.parameters import ParameterLocation
from schemathesis.core.result import Ok
from schemathesis.generation.meta import CoveragePhaseData
from schemathesis.pytest.lazy import get_all_tests
from schemathesis.schemas import BaseSchema

from gaitswarm.api.app import create_app
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store import open_store
from gaitswarm.settings import Settings
from tests.api.conformance import CHECKS, campaign, config
from tests.examples.api_document import api_document
from tests.examples.servers import Server

_NAMED = {
    "SimulationRequest": ("scenarios", "preference"),
    "RobustnessRequest": ("robot", "scenarios"),
    "ReplayRequest": ("robot", "scenario"),
    "MeasuredWalkRequest": ("robot", "scenario"),
}
"""Fields of bodies whose models are also part of another body."""


@cache
def _document() -> dict[str, Any]:
    """The server's own, but with examples in place of most specs, and names in place of models.

    Making all cases of specs takes minutes. All kinds are read alike: cases are made of those that
    tune a drive where jobs are submitted, and of all by `python -m tests.api.conformance`. Of
    robots, scenarios and preferences, cases are made in one body each; others name them.
    """
    document = api_document()
    models = document["components"]["schemas"]
    for path, made in (("/v1/jobs", "JobSpec"), ("/v1/estimates", "")):
        content = document["paths"][path]["post"]["requestBody"]["content"]["application/json"]
        kinds = {kind["$ref"].rpartition("/")[2]: kind for kind in content["schema"]["oneOf"]}
        examples = [example for name in kinds for example in models[name]["examples"]]
        whole = [kind for name, kind in kinds.items() if name == made]
        content["schema"] = {"anyOf": [*whole, {"enum": examples}]}
    for model, fields in _NAMED.items():
        for field in fields:
            schema = models[model]["properties"][field]
            either = schema.get("items", schema)
            either["oneOf"] = [kind for kind in either["oneOf"] if "$ref" not in kind]
    return document


@cache
def _schema() -> BaseSchema:
    schema = schemathesis.openapi.from_dict(_document(), config=config())
    schema.hook(filter_case)
    return schema


# Of the routes, as the document takes seconds, in every process that collects tests. Streams end
# with their jobs only, and are tested apart.
_OPERATIONS = [
    f"{method} {route.path}"
    for route in create_app(cast(JobService, None), settings=Settings()).routes
    if isinstance(route, APIRoute) and route.include_in_schema and route.name != "stream_events"
    for method in sorted(route.methods or ())
]

_SETTINGS = settings(
    deadline=None,
    database=None,
    phases=[Phase.explicit],
    suppress_health_check=list(HealthCheck),
)

_NAMES = re.compile(r"(?:^|-> )(\w+)(?= ->|:)|'(\w+)' value: ")
"""Properties in the description of a case, from the outermost to the innermost."""

_seen: set[object] = set()


def filter_case(_: schemathesis.HookContext, case: schemathesis.Case[Any]) -> bool:
    """Whether a case has something in it that none had before.

    Every operation is sent each kind of wrong value in its path, its query and its body, and every
    property of every model a wrong and a right value. Each with each, and values by chance, are
    sent by `python -m tests.api.conformance`.
    """
    if "x-schemathesis-unknown-property" in case.headers:
        # Any request may have further headers.
        return False
    assert case.meta is not None
    coverage = case.meta.phase.data
    if not isinstance(coverage, CoveragePhaseData):
        return True
    label, mode = case.operation.label, case.meta.generation.mode
    where = coverage.parameter_location
    if mode.is_positive:
        tried: set[object] = {(label, where, "good"), (where, coverage.scenario)}
    else:
        tried = {(label, where, coverage.scenario)}
    names = [outer or inner for outer, inner in _NAMES.findall(coverage.description)]
    if where is ParameterLocation.BODY and names:
        # What is within a property is part of a model that other operations take, too.
        tried.add((mode, *(names[-2:] if len(names) > 1 else (label, *names))))
    elif where is ParameterLocation.QUERY:
        tried.add((mode, label, coverage.parameter))
    new = not tried <= _seen
    _seen.update(tried)
    return new


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A server with short limits on simulations."""
    store = open_store(str(tmp_path_factory.mktemp("conformance") / "jobs.db"))
    server = Server(
        JobService(store),
        api_max_simulated_seconds=3.0,
        api_max_logged_seconds=2.0,
        api_max_sampled_seconds=30.0,
    )
    yield server.url
    server.close()
    store.close()


def is_as_documented(case: schemathesis.Case[Any], url: str, connected: Session) -> None:
    # An estimate may compile a kernel, while other tests run.
    case.call_and_validate(base_url=url, session=connected, checks=CHECKS, timeout=120.0)


@pytest.mark.variants(
    without=("POST /v1/estimates", "POST /v1/jobs", "POST /v1/jobs/{job_id}/fork")
)
@pytest.mark.slow
@pytest.mark.parametrize("operation", _OPERATIONS)
def test_every_answer_is_as_documented(operation: str, url: str) -> None:
    # Cases are made here: `schema.parametrize` makes those of all operations, which takes half a
    # minute, in every process that collects tests.
    (made,) = get_all_tests(
        schema=_schema().include(name=operation),
        test_func=is_as_documented,
        settings=_SETTINGS,
        given_kwargs={},
    )
    assert isinstance(made, Ok)
    _, send_all = made.ok()
    # A connection for each of a thousand requests would take longer than their answers.
    with Session() as connected:
        connected.trust_env = False
        send_all(url=url, connected=connected)


@pytest.mark.slow
def test_every_operation_of_the_document_is_among_them() -> None:
    assert {
        f"{method.upper()} {path}"
        for path, methods in _document()["paths"].items()
        for method, operation in methods.items()
        if operation["operationId"] != "stream_events"
    } == set(_OPERATIONS)


@pytest.mark.thorough("test_every_answer_is_as_documented, one answer after another")
@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_ten_minutes_of_requests_and_sequences_are_answered_as_documented() -> None:
    found = campaign(cases=1000, seed=1, minutes=10.0)
    assert (found.failures, found.tracebacks) == ({}, [])
    statuses = {status for _, status in found.answers}
    # Some have followed a job that they had submitted, or found.
    assert {200, 202, 409} <= statuses
    assert max(statuses) < 500
