"""Bodies by anybody: validated where they hold nobody up, robots in them checked elsewhere.

What a body is validated by is Python: in the event loop, every other request would wait for it.
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
"""Names of fields in a body, designs to start from aside: each may be an error to be told."""

MOST_VARIABLES: Final = 128
"""Names of a design to start from that do not count."""


def validated(model: Any, name: str) -> Callable[..., Any]:
    """A dependency that reads the body of a request and validates it in a thread."""
    adapter: TypeAdapter[Any] = TypeAdapter(model)

    async def read(http: Request, **body: Any) -> Any:
        work = partial(_validated, model, adapter, body[name])
        return await run_sync(work, limiter=http.state.validations)

    # FastAPI knows of the body and its schema by this; the validation is put off.
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
        found = with_known_keys(error.errors(include_url=False), model)
        raise RequestValidationError(
            [{**entry, "loc": ("body", *entry["loc"])} for entry in found], body=document
        ) from error


def _check_bounds(document: Any) -> None:
    """What is costly before it is refused: very many names, and robots."""
    names, robots = 0, list[tuple[Location, str, str]]()
    for where, part in objects_in(document):
        # Of designs to start from the first bad one is told; there may be many.
        names += len(part) if where[-2:-1] != ("start",) else max(0, len(part) - MOST_VARIABLES)
        files = files_of(part)
        if files is not None:
            robots.append((where, *files))
        if names > MOST_NAMES:
            raise _refusal(where, f"more than {MOST_NAMES} fields by here; send fewer", document)
        if len(robots) > MOST_ROBOTS:
            many = f"more than {MOST_ROBOTS} robots of your own; send fewer"
            raise _refusal(where, many, document)
    for where, toml, urdf in robots:
        try:
            check_files(toml, urdf)
        except RobotFileError as error:
            raise _refusal(where, str(error), document) from error


def _refusal(where: Location, problem: str, document: Any) -> RequestValidationError:
    entry = {"type": "value_error", "loc": ("body", *where), "msg": problem, "input": None}
    return RequestValidationError([entry], body=document)
