"""What the API says of itself: the OpenAPI document, and /docs to read and to try it."""

from __future__ import annotations

import base64
import hashlib
import re
from typing import Any, Final, cast

from fastapi import FastAPI, Request, Response
from fastapi.openapi.docs import get_swagger_ui_html
from pydantic import BaseModel
from pydantic.json_schema import JsonSchemaMode, models_json_schema

from gaitswarm.api.links import add_links
from gaitswarm.api.middleware import security_policy
from gaitswarm.api.problems import MEDIA_TYPE
from gaitswarm.views import ParticlesHeaderView, ProblemView
from gaitswarm.views.base import MEDIA_TYPE as BINARY
from gaitswarm.views.replay import ReplayHeaderView

DESCRIPTION: Final = """
Finds robust drive controllers for walking robots: a controller is tried in several walking
scenarios at once, in a fast simulation, and a search method improves it.

1. Look at what can be tuned: **GET /v1/controllers**, **/v1/robots**, **/v1/scenarios**,
   **/v1/preferences**.
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
    {"name": "robots", "description": "Robots of one's own, made of a URDF and looked at."},
    {"name": "catalogue", "description": "What there is to choose from."},
    {"name": "session", "description": "Who is asking, for browsers."},
    {"name": "health", "description": "For load balancers and container engines."},
]

ASSETS: Final = "/docs-assets"
"""Where the scripts of /docs lie."""

_MEANING: Final = {
    400: "The body is not JSON.",
    401: "A token is asked for, or the one that was sent is not valid.",
    403: "The token does not allow this, or a page of another origin asks for it.",
    404: "No such job, or nothing of that kind in it yet.",
    409: "The job's state does not allow it, the idempotency key belongs to another request, or its"
    " owner has too many unfinished jobs.",
    413: "The body is too large.",
    422: "A field is not valid; `errors` names it.",
    429: "Too many requests with this token or from this address; `Retry-After` says when.",
    500: "A bug on the server; the log names the cause under the request id.",
    503: "The database or the simulator cannot answer now; try again later.",
}

_HEADERS: Final = (ReplayHeaderView, ParticlesHeaderView)
"""What is JSON inside binary answers, which FastAPI does not see."""

_BEARER: Final = {
    "type": "http",
    "scheme": "bearer",
    "description": "A token of this server, as `gaitswarm token create` makes them, needed wherever"
    " the server listens beyond its own machine. Browsers send it as a cookie (`/v1/session`).",
}

_SCHEMAS: Final = "#/components/schemas/"

_INLINE_SCRIPT: Final = re.compile(rb"<script(?![^>]*\bsrc=)[^>]*>(.*?)</script>", re.DOTALL)

Responses = dict[int | str, dict[str, Any]]


def problems(*statuses: int, asks: bool = True) -> Responses:
    """Document a route's problems."""
    # By name: as a `model`, each of some 150 answers would have a validator of its own.
    content = {MEDIA_TYPE: {"schema": {"$ref": f"{_SCHEMAS}{ProblemView.__name__}"}}}
    return {
        status: {"description": _MEANING[status], "content": content}
        for status in (*statuses, *((401, 429) if asks else ()), 500, 503)
    }


def binary(description: str, *media_types: str) -> Responses:
    """Document a route that answers bytes."""
    schema = {"type": "string", "format": "binary"}
    content = {media_type: {"schema": schema} for media_type in media_types or (BINARY,)}
    return {200: {"description": description, "content": content}}


def add_documentation(app: FastAPI) -> None:
    """Complete the OpenAPI document and serve /docs."""
    derive = app.openapi

    def openapi() -> dict[str, Any]:
        document = derive()
        known = document["components"]["schemas"] | _schemas(ProblemView)
        known = dict(sorted(known.items()))
        document["components"]["schemas"] = _schemas(*_HEADERS) | known
        document["components"]["securitySchemes"] = {"token": _BEARER}
        # Or none: a server that listens to its own machine alone asks for no token.
        document["security"] = [{"token": []}, {}]
        add_links(document)
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
        page.headers["Content-Security-Policy"] = policy_of(bytes(page.body))
        return page

    app.add_route("/docs", documentation, include_in_schema=False)


def _schemas(*models: type[BaseModel]) -> dict[str, Any]:
    """Of models that FastAPI does not see, with all that they refer to."""
    wanted: list[tuple[type[BaseModel], JsonSchemaMode]] = [(m, "serialization") for m in models]
    _, schemas = models_json_schema(wanted, ref_template=f"{_SCHEMAS}{{model}}")
    return cast(dict[str, Any], schemas["$defs"])


def policy_of(page: bytes) -> str:
    """The policy of a page that other projects' scripts make."""
    hashes = [
        f"'sha256-{base64.b64encode(hashlib.sha256(script).digest()).decode()}'"
        for script in _INLINE_SCRIPT.findall(page)
    ]
    return security_policy(
        script_src=" ".join(["'self'", *hashes]), style_src="'self' 'unsafe-inline'"
    )
