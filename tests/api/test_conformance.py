"""The server keeps to its own OpenAPI document, whatever it is sent."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, cast

import pytest
import schemathesis
from hypothesis import HealthCheck, Phase, settings
from schemathesis.checks import not_a_server_error
from schemathesis.specs.openapi.checks import (
    content_type_conformance,
    response_headers_conformance,
    response_schema_conformance,
    status_code_conformance,
    unsupported_method,
)

from api.app import create_app
from gaitswarm.settings import Settings
from services.optimizer.service import JobService
from services.optimizer.store.sql_store import open_store
from tests.examples.servers import Server

CHECKS = [
    not_a_server_error,
    content_type_conformance,
    response_headers_conformance,
    response_schema_conformance,
    status_code_conformance,
    unsupported_method,
]


# The parameters of a test are needed before there is a server: the document is the same without.
_APP = create_app(cast(JobService, None), settings=Settings())

# Streams end with their jobs only, and are tested apart.
schema = schemathesis.openapi.from_dict(_APP.openapi()).exclude(operation_id="stream_events")


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A server that lets nobody walk for long."""
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


@pytest.mark.slow
@schema.parametrize()
@settings(
    max_examples=6,
    derandomize=True,
    deadline=None,
    database=None,
    phases=[Phase.explicit, Phase.generate],
    suppress_health_check=list(HealthCheck),
)
def test_every_answer_is_as_documented(case: schemathesis.Case[Any], url: str) -> None:
    case.call_and_validate(base_url=url, checks=CHECKS)
