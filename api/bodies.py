"""Validation of request bodies in threads, with checks of the robots in them.

In the event loop, validation would delay every other request.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import partial
from typing import Annotated, Any, Final

from anyio.to_thread import run_sync
from fastapi import Body, Request
from fastapi.exceptions import RequestValidationError
from pydantic import TypeAdapter, ValidationError, WrapValidator

from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.input import with_known_keys
from gaitswarm.sim.robot.check import MOST_ROBOTS, Location, check_files, files_of, objects_in

MOST_NAMES: Final = 10_000
"""Fields in a body, without start designs; each may yield an error."""

MOST_VARIABLES: Final = 128
"""Fields of a start design that do not count."""


def validated(model: Any, name: str) -> Callable[..., Any]:
    """Return a dependency that reads the body of a request and validates it in a thread."""
    adapter: TypeAdapter[Any] = TypeAdapter(model)

    async def read(http: Request, **body: Any) -> Any:
        work = partial(_validated, model, adapter, body[name])
        return await run_sync(work, limiter=http.state.validations)

    # The signature gives FastAPI the body and its schema, without validating it.
    kind = inspect.Parameter.POSITIONAL_OR_KEYWORD
    as_sent = Annotated[model, WrapValidator(lambda document, _: document), Body()]
    read.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
        [
            inspect.Parameter("http", kind, annotation=Request),
            inspect.Parameter(name, kind, annotation=as_sent),
        ]
    )
    return read


def _validated(model: Any, adapter: TypeAdapter[Any], document: Any) -> Any:
    _check_bounds(document)
    try:
        return adapter.validate_python(document)
    except ValidationError as error:
        entries = with_known_keys(error.errors(include_url=False), model)
        raise RequestValidationError(
            [{**entry, "loc": ("body", *entry["loc"])} for entry in entries], body=document
        ) from error


def _check_bounds(document: Any) -> None:
    """Limit what is costly to validate: many fields, and robots."""
    names, robots = 0, list[tuple[Location, str, str]]()
    for where, part in objects_in(document):
        # Only the first invalid start design is reported, so they do not count.
        names += len(part) if where[-2:-1] != ("start",) else max(0, len(part) - MOST_VARIABLES)
        files = files_of(part)
        if files is not None:
            robots.append((where, *files))
        if names > MOST_NAMES:
            problem = f"more than {MOST_NAMES} fields in the body; send fewer"
            raise _refusal(where, problem, document)
        if len(robots) > MOST_ROBOTS:
            problem = f"more than {MOST_ROBOTS} custom robots; send fewer"
            raise _refusal(where, problem, document)
    for where, toml, urdf in robots:
        try:
            check_files(toml, urdf)
        except RobotFileError as error:
            raise _refusal(where, str(error), document) from error


def _refusal(where: Location, problem: str, document: Any) -> RequestValidationError:
    entry = {"type": "value_error", "loc": ("body", *where), "msg": problem, "input": None}
    return RequestValidationError([entry], body=document)
