"""One request of the HTTP API as a value, and what most of them have in common."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, Generic, TypeVar
from urllib.parse import quote

from pydantic import BaseModel

from gaitswarm.errors import NotFound

T = TypeVar("T")
V = TypeVar("V", bound=BaseModel)

IDEMPOTENCY_KEY: Final = "Idempotency-Key"
NOTIFY_URL: Final = "Notify-URL"
JOB_PRIORITY: Final = "Job-Priority"

_PAGE: Final = 100
"""Items asked for at once."""


@dataclass(frozen=True, slots=True)
class Call(Generic[T]):
    """One request.

    Attributes:
        method: HTTP method.
        path: Path under the API's prefix.
        read: Makes the result of a successful answer's body; raises ValueError for one that is
            not what it should be.
        params: Query.
        body: JSON; None for none.
        headers: Further headers.
        reads: Whether it changes nothing on the server, as no GET does.
    """

    method: str
    path: str
    read: Callable[[bytes], T]
    params: Mapping[str, str | Sequence[str]] = field(default_factory=dict)
    body: str | None = None
    headers: Mapping[str, str] = field(default_factory=dict)
    reads: bool = False

    @property
    def repeatable(self) -> bool:
        """Whether sending it twice does what sending it once does."""
        return self.reads or self.method == "GET" or IDEMPOTENCY_KEY in self.headers


def got(path: str, kind: type[V]) -> Call[V]:
    """Ask for a resource.

    Args:
        path: Under the API's prefix.
        kind: Of the answer.
    """
    return Call("GET", path, kind.model_validate_json)


def posted(
    path: str,
    kind: type[V],
    body: BaseModel,
    headers: Mapping[str, str] | None = None,
    *,
    reads: bool = False,
) -> Call[V]:
    """Send a document.

    Args:
        path: Under the API's prefix.
        kind: Of the answer.
        body: What is sent.
        headers: Further headers.
        reads: Whether it changes nothing on the server.
    """
    read, text = kind.model_validate_json, body.model_dump_json()
    return Call("POST", path, read, body=text, headers=headers or {}, reads=reads)


def page(
    path: str, kind: type[V], after: str | None, params: Mapping[str, str] | None = None
) -> Call[V]:
    """Ask for a page of a list.

    Args:
        path: Under the API's prefix.
        kind: Of the answer.
        after: `next` of the page before; None for the first page.
        params: Further parts of the query.
    """
    cursor = {} if after is None else {"after": after}
    chosen = {**(params or {}), **cursor, "limit": str(_PAGE)}
    return Call("GET", path, kind.model_validate_json, chosen)


def job_path(job_id: str) -> str:
    """Path of a job.

    Args:
        job_id: Its identifier.

    Raises:
        NotFound: No job can have it.
    """
    return f"/jobs/{segment(job_id, 'job')}"


def segment(name: str, what: str) -> str:
    """An id or a name as one segment of a path.

    Args:
        name: The id or name.
        what: Of what it is, for messages.

    Raises:
        NotFound: It cannot be a segment.
    """
    if not name or name in (".", ".."):
        raise NotFound(f"no {what} has the id {name!r}")
    return quote(name, safe="")
