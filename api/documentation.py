"""Documentation of the API: the OpenAPI document, and /docs."""

from __future__ import annotations

import base64
import hashlib
import re
from typing import Any, Final, cast

from fastapi import FastAPI, Request, Response
from fastapi.openapi.docs import get_swagger_ui_html
from fastapi.responses import HTMLResponse
from pydantic import BaseModel
from pydantic.json_schema import JsonSchemaMode, models_json_schema

from gaitswarm.api.middleware import security_policy
from gaitswarm.api.problems import MEDIA_TYPE
from gaitswarm.replay import ReplayHeaderView
from gaitswarm.services.optimizer.analysis.distribution import ParticlesHeaderView
from gaitswarm.services.optimizer.views import MEDIA_TYPE as BINARY
from gaitswarm.views.base import ProblemView

DESCRIPTION: Final = """
Finds robust drive controllers for walking robots: a controller is simulated in several walking
scenarios, and a search method improves it.

1. List the options: **GET /v1/controllers**, **/v1/robots**, **/v1/scenarios**,
   **/v1/preferences**.
2. Simulate one design: **POST /v1/simulations**.
3. Submit a job: **POST /v1/jobs** returns the job's id at once.
4. Follow it: **GET /v1/jobs/{id}/events** streams its committed iterations.
5. Get the result: **GET /v1/jobs/{id}/best**.

All objectives, utilities and fitness values are minimized. Units are SI unless a field says
otherwise; controller variables in `counts` are coded integers of the microcontroller. Undefined
numbers (the objectives of a robot that fell) are null. Errors are problems (RFC 9457): `detail`
names the remedy, `errors` lists every invalid field. Every response has an `X-Request-ID`, which
the server's log contains; clients may send their own.
"""

TAGS: Final[list[dict[str, str]]] = [
    {"name": "core", "description": "Jobs: submit, follow, control, and get the best design."},
    {"name": "analysis", "description": "Evaluations of jobs, and simulations of single designs."},
    {
        "name": "robots",
        "description": "Custom robots, measured walks, and the options of jobs and simulations.",
    },
    {
        "name": "operations",
        "description": "Forks, labels and deletion of jobs; sessions, audit log and health.",
    },
]

ASSETS: Final = "/docs-assets"
"""Path of the scripts of /docs."""

_MEANING: Final = {
    400: "The body is not JSON.",
    401: "A token is required, or the token sent is invalid.",
    403: "The token does not permit this, or the request comes from a page of another origin.",
    404: "The job does not exist, or has no such data yet.",
    409: "The job's state does not permit this, the idempotency key belongs to another request, or"
    " the quota of unfinished jobs is exceeded.",
    413: "The body is too large.",
    422: "A field is invalid; `errors` names it.",
    429: "Too many invalid tokens from this address; see `Retry-After`.",
    500: "Internal error; the log has the cause under the request id.",
    503: "The database or the simulator is unavailable, or busy; see `Retry-After`.",
}

_HEADERS: Final = (ReplayHeaderView, ParticlesHeaderView)
"""JSON inside binary responses, which FastAPI does not see."""

_BEARER: Final = {
    "type": "http",
    "scheme": "bearer",
    "description": "A token made by `gaitswarm token create`, required if the server listens beyond"
    " its own machine. Browsers send it as a cookie (`/v1/session`).",
}

_SCHEMAS: Final = "#/components/schemas/"

_INLINE_SCRIPT: Final = re.compile(rb"<script(?![^>]*\bsrc=)[^>]*>(.*?)</script>", re.DOTALL)

Responses = dict[int | str, dict[str, Any]]


def problems(*statuses: int, guarded: bool = True) -> Responses:
    """Document a route's problems."""
    # By reference: as a `model`, each of some 150 responses would have a validator of its own.
    content = {MEDIA_TYPE: {"schema": {"$ref": f"{_SCHEMAS}{ProblemView.__name__}"}}}
    return {
        status: {"description": _MEANING[status], "content": content}
        for status in (*statuses, *((401, 429) if guarded else ()), 500, 503)
    }


def binary(description: str, *media_types: str) -> Responses:
    """Document a route that returns bytes."""
    schema = {"type": "string", "format": "binary"}
    content = {media_type: {"schema": schema} for media_type in media_types or (BINARY,)}
    return {200: {"description": description, "content": content}}


def add_documentation(app: FastAPI) -> None:
    """Complete the OpenAPI document and serve /docs."""
    derive = app.openapi

    def openapi() -> dict[str, Any]:
        document = derive()
        schemas = document["components"]["schemas"] | _schemas(ProblemView)
        schemas = dict(sorted(schemas.items()))
        document["components"]["schemas"] = _schemas(*_HEADERS) | schemas
        document["components"]["securitySchemes"] = {"token": _BEARER}
        # The empty one: a server that listens on its own machine only requires no token.
        document["security"] = [{"token": []}, {}]
        return document

    app.openapi = openapi  # type: ignore[method-assign]

    def documentation(request: Request) -> Response:
        root = request.scope.get("root_path", "")
        page = get_swagger_ui_html(
            openapi_url=f"{root}{app.openapi_url}",
            title=f"{app.title}: the API",
            swagger_js_url=f"{root}{ASSETS}/swagger-ui-bundle.js",
            swagger_css_url=f"{root}{ASSETS}/swagger-ui.css",
            swagger_favicon_url=f"{root}{ASSETS}/favicon.png",
        )
        body = bytes(page.body).replace(b"<html>", b'<html lang="en">')
        return HTMLResponse(body, headers={"Content-Security-Policy": policy_of(body)})

    app.add_route("/docs", documentation, include_in_schema=False)


def _schemas(*models: type[BaseModel]) -> dict[str, Any]:
    """Return schemas of models that FastAPI does not see, and of all that they reference."""
    inputs: list[tuple[type[BaseModel], JsonSchemaMode]] = [(m, "serialization") for m in models]
    _, schemas = models_json_schema(inputs, ref_template=f"{_SCHEMAS}{{model}}")
    return cast(dict[str, Any], schemas["$defs"])


def policy_of(page: bytes) -> str:
    """Return the content security policy of a page with inline scripts of other projects."""
    hashes = [
        f"'sha256-{base64.b64encode(hashlib.sha256(script).digest()).decode()}'"
        for script in _INLINE_SCRIPT.findall(page)
    ]
    return security_policy(
        script_src=" ".join(["'self'", *hashes]), style_src="'self' 'unsafe-inline'"
    )
