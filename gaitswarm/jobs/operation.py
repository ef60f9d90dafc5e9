"""Operations: methods of `Jobs` that are requests of the REST API as well."""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial, wraps
from pathlib import Path
from types import ModuleType
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    Final,
    Literal,
    NamedTuple,
    TypeVar,
    cast,
    get_type_hints,
)

from pydantic import BaseModel, Field, TypeAdapter, create_model
from pydantic.fields import FieldInfo

from gaitswarm.docstrings import Docstring, docstring_of
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.audit import LOCAL
from gaitswarm.services.optimizer.jobs.documents import AnySpec
from gaitswarm.services.optimizer.jobs.job import Quota
from gaitswarm.services.optimizer.views import MEDIA_TYPE as BINARY
from gaitswarm.services.optimizer.views import Request
from gaitswarm.specs import SpecOptions, checked, chosen_spec

if TYPE_CHECKING:
    from gaitswarm.services.monitoring.activity import Activity

F = TypeVar("F", bound=Callable[..., Any])

Tag = Literal["core", "analysis", "robots", "operations"]
Access = Literal["read", "submit", "command", "restore", "admin"]
"""Permission that a token needs; `command`: to command the job of the path."""

JobIdText = Annotated[
    str, Field(min_length=1, max_length=64, pattern=r"^[A-Za-z0-9_-]+$", examples=["k2q7zr5dm9xw"])
]

LARGEST_INDEX: Final = 2**31 - 1
"""Largest index of an iteration in the database."""

Index = Annotated[int, Field(ge=0, le=LARGEST_INDEX)]
After = Annotated[str | None, Field(max_length=1000, description="`next` of the previous page.")]
AfterIteration = Annotated[
    int | None, Field(ge=0, le=LARGEST_INDEX, description="Only iterations with a greater index.")
]
PageLimit = Annotated[int, Field(ge=1, le=200)]
SearchText = Annotated[str, Field(max_length=200)]


class Limits(NamedTuple):
    """What one request may compute: length of all its simulations [s]."""

    simulated: float = math.inf
    logged: float = math.inf
    sampled: float = math.inf  # of samples of designs

    def check(self, seconds: float, *, field: str, logged: bool = False) -> None:
        """Reject simulations that are too long in total."""
        limit, what = (self.logged, "allowed with logs") if logged else (self.simulated, "allowed")
        _check_length(seconds, limit, f"{what}; choose fewer scenarios or cycles", field)

    def check_sampled(self, seconds: float, field: str = "samples") -> None:
        """Reject samples of designs or of evaluations whose simulations are too long in total."""
        _check_length(seconds, self.sampled, "allowed; choose fewer", field)


def _check_length(seconds: float, limit: float, advice: str, field: str) -> None:
    if seconds > limit:
        text = f"the simulations last {seconds:g} s in total, more than the {limit:g} s {advice}"
        raise InvalidRequest(text, field=field)


class Context(NamedTuple):
    """What a server adds to the arguments of an operation: the client, and what it may do."""

    actor: str = LOCAL
    quota: Quota | None = None
    limits: Limits = Limits()
    check_priority: Callable[[int], None] = lambda _: None  # raises Forbidden
    activity: Activity | None = None
    robots: Sequence[Path] = ()  # folders in which to look for meshes


def _types() -> ModuleType:
    from gaitswarm.jobs import types

    return types


@dataclass(frozen=True, eq=False)
class Operation:
    """A method of `Jobs` and its request.

    The arguments that the path does not name are the query of a GET. Otherwise they are the body: a
    model of that name, or of that class, which may be "types." and its name in `jobs.types`;
    without `body`, the only one is the whole body, and with AnySpec a spec and options are combined
    to it.
    """

    function: Callable[..., Any]
    method: str
    path: str
    tag: Tag
    summary: str
    id: str
    heavy: bool = False  # it simulates or reads whole histories; a server limits how many run
    access: Access = "read"
    status: int = 200
    body: Any = None
    optional: bool = False  # a request may have no body
    media_type: str = BINARY
    media_types: Mapping[str, str] = field(default_factory=dict)  # of streams, by `format`
    filename: str | None = None  # of the download, with arguments
    cached: bool = False  # by its ETag
    location: Callable[[Any], str] | None = None  # of what it creates, given the answer
    page: bool = False  # only the web page uses it

    @property
    def reads(self) -> bool:
        """Whether it changes nothing, so that a client may send it again."""
        return self.method == "GET" or self.access == "read"

    @cached_property
    def docstring(self) -> Docstring:
        return docstring_of(self.function)

    @cached_property
    def signature(self) -> inspect.Signature:
        return inspect.signature(self.function)

    @cached_property
    def hints(self) -> dict[str, Any]:
        """Types of the arguments, and of the answer as `return`."""
        try:
            return get_type_hints(self.function, include_extras=True)
        except NameError:
            return get_type_hints(self.function, None, {"types": _types()}, include_extras=True)

    @property
    def result(self) -> Any:
        return self.hints["return"]

    @cached_property
    def adapter(self) -> TypeAdapter[Any]:
        return TypeAdapter(self.result)

    @cached_property
    def path_names(self) -> tuple[str, ...]:
        return tuple(re.findall(r"\{(\w+)\}", self.path))

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Arguments that the path does not name."""
        _, *names = self.signature.parameters
        return tuple(name for name in names if name not in self.path_names)

    @cached_property
    def is_whole(self) -> bool:
        """Whether one argument is the whole body."""
        return self.method != "GET" and self.body in (None, AnySpec) and bool(self.names)

    @cached_property
    def request(self) -> Any:
        """Model of the query or the body; None for neither."""
        if not self.names:
            return None
        if self.is_whole:
            return self.body or self.hints[self.names[0]]
        if isinstance(self.body, type):
            return self.body
        fields = dict(map(self._field, self.names))
        base = BaseModel if self.body is None else Request
        name = self.body or f"{self.id}_query"
        if name.startswith("types."):
            return getattr(_types(), name.removeprefix("types."))
        return create_model(name, __base__=base, __doc__=f"{self.summary}.", **fields)

    def _field(self, name: str) -> tuple[str, Any]:
        """Return name, type and default of an argument in the request."""
        default = self.signature.parameters[name].default
        hint = self.hints[name]
        if name == "job_ids":
            # The path has the first one.
            limits = [part for part in hint.__metadata__ if isinstance(part, FieldInfo)]
            return "also", (Annotated[list[JobIdText], *limits], [])
        described = Field(description=self.docstring.arguments.get(name))
        annotation = Annotated[hint, described] if described.description else hint
        return name, (annotation, ... if default is inspect.Parameter.empty else default)

    def validated(self, arguments: Mapping[str, Any]) -> tuple[dict[str, Any], BaseModel | None]:
        """Split arguments into parameters of the path and the request."""
        given = dict(arguments)
        if "job_ids" in given:
            job_ids = given.pop("job_ids")
            if isinstance(job_ids, str) or not job_ids:
                raise InvalidRequest("must be a list of at least one id", field="job_ids")
            given["job_id"], *given["also"] = job_ids
        path = {name: given.pop(name) for name in self.path_names}
        if self.request is None:
            return path, None
        if self.body is AnySpec:
            return path, chosen_spec(given.pop("spec"), cast(SpecOptions, given))
        if self.is_whole:
            return path, given[self.names[0]]
        return path, checked(self.request, given)

    def arguments(self, path: Mapping[str, Any], request: Any) -> dict[str, Any]:
        """Return the arguments of the function for a validated request."""
        if self.is_whole:
            return {**path, self.names[0]: request}
        given = {**path}
        if request is not None:
            given |= {name: getattr(request, name) for name in type(request).model_fields}
        if "also" in given:
            given["job_ids"] = [given.pop("job_id"), *given.pop("also")]
        return given


ZIP: Final = "application/zip"

OPERATIONS: Final[list[Operation]] = []
"""All operations that have been imported."""


def operation(tag: Tag, route: str, id: str, summary: str, **options: Any) -> Callable[[F], F]:  # noqa: A002
    """Make a method of `Jobs`, or a function of them, an operation of a chapter (`tag`).

    Its body computes the answer in a process that has the database; jobs behind a server send a
    request instead. The docstring documents both: its text describes the operation, "Args" the
    parameters, "Returns" the answer, and "Raises" the statuses of errors.
    """
    method, path = route.split()

    def add(function: F) -> F:
        made = Operation(function, method, path, tag, summary, id, **options)
        OPERATIONS.append(made)

        @wraps(function)
        def call(jobs: Any, *arguments: Any, **named: Any) -> Any:
            bound = made.signature.bind(jobs, *arguments, **named)
            bound.apply_defaults()
            _, *given = bound.arguments.items()
            named = dict(given)
            rest = named.pop("options", {})
            try:
                return jobs._answer(made, named | rest)  # noqa: SLF001
            except InvalidRequest as error:
                if not error.field.startswith("also"):
                    raise
                message = str(error).removeprefix(f"{error.field}: ")
                raise InvalidRequest(f"{message}, after the first", field="job_ids") from error

        return cast(F, call)

    return add


core = partial(operation, "core")
analysis = partial(operation, "analysis", heavy=True)
robots = partial(operation, "robots")
operations = partial(operation, "operations")
commands = partial(operation, "operations", access="command")
