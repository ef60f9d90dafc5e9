"""The OpenAPI document: what FastAPI derives, with problems under their own media type."""

from __future__ import annotations

from typing import Any, Final

from fastapi import FastAPI
from pydantic import BaseModel
from pydantic.json_schema import models_json_schema

from api.problems import MEDIA_TYPE
from gaitswarm.views import ProblemView

DESCRIPTION: Final = """
Finds robust drive controllers for walking robots: a controller is tried in several walking
scenarios at once, in a fast simulation, and a particle swarm improves it.

1. Look at what can be tuned: **GET /v1/controllers**, **/v1/scenarios**, **/v1/preferences**.
2. Try one design: **POST /v1/simulations**.
3. Submit a job: **POST /v1/jobs** answers at once with the job's id.
4. Follow it: **GET /v1/jobs/{id}/events** is a stream of its committed iterations.
5. Take the result: **GET /v1/jobs/{id}/best**.

All objectives, utilities and fitnesses are minimized. Units are SI unless a field says otherwise;
controller variables in `counts` are coded integers of the microcontroller. Numbers that do not
exist (the objectives of a robot that fell) are null. Errors are problems (RFC 9457): `detail` says
what to do, `errors` names every offending field. Every answer has an `X-Request-ID`, by which the
server's log names it; a client may send its own.
"""

TAGS: Final[list[dict[str, str]]] = [
    {"name": "jobs", "description": "Optimizations: submit, follow, pause, resume, cancel."},
    {"name": "history", "description": "What a job has committed: iterations and evaluations."},
    {"name": "analysis", "description": "Questions about all evaluations of a job at once."},
    {"name": "recordings", "description": "Measured walks, to which a robot is fitted."},
    {"name": "simulations", "description": "One design walking on request, outside any job."},
    {"name": "catalogue", "description": "What there is to choose from."},
    {"name": "health", "description": "For load balancers and container engines."},
]

_MEANING: Final = {
    400: "The body is not JSON.",
    404: "No such job, or nothing of that kind in it yet.",
    409: "The job's state does not allow it, or the idempotency key belongs to another request.",
    413: "The body is too large.",
    422: "A field is not valid; `errors` names it.",
    500: "A bug on the server; the log names the cause under the request id.",
    503: "The database or the simulator cannot answer now; try again later.",
}

Responses = dict[int | str, dict[str, Any]]


def problems(*statuses: int) -> Responses:
    """Documentation of a route's problems; 500 and 503 go without saying."""
    return {
        status: {"model": ProblemView, "description": _MEANING[status]}
        for status in (*statuses, 500, 503)
    }


def document_problems(app: FastAPI) -> None:
    """Let the application's OpenAPI document name problem+json wherever a problem is answered."""
    derive = app.openapi

    def openapi() -> dict[str, Any]:
        document = derive()
        for operations in document["paths"].values():
            for operation in operations.values():
                for status, response in operation["responses"].items():
                    if status >= "400":
                        (body,) = response["content"].values()
                        response["content"] = {MEDIA_TYPE: body}
        return document

    app.openapi = openapi  # type: ignore[method-assign]


def document_headers(app: FastAPI, *headers: type[BaseModel]) -> None:
    """Add the schemas of what is JSON inside binary answers to the OpenAPI document."""
    derive = app.openapi

    def openapi() -> dict[str, Any]:
        document = derive()
        _, schemas = models_json_schema(
            [(header, "serialization") for header in headers],
            ref_template="#/components/schemas/{model}",
        )
        components = document["components"]
        components["schemas"] = schemas["$defs"] | components["schemas"]
        return document

    app.openapi = openapi  # type: ignore[method-assign]
