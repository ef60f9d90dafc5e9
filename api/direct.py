"""The short way to frequent answers: by no route, no dependency, and mostly no other thread."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final, cast
from urllib.parse import parse_qsl

from anyio import CapacityLimiter
from anyio.to_thread import run_sync
from fastapi import Request, Response
from starlette.types import ASGIApp, Receive, Scope, Send

from gaitswarm.api.answers import Answers, Encoded
from gaitswarm.api.dependencies import service_of
from gaitswarm.api.problems import DOMAIN_ERRORS, domain_problem
from gaitswarm.api.reads import Best, Evaluations, InFull, Iterations, JobList, JobQuestion
from gaitswarm.services.optimizer.jobs.job import JobOrder, JobState
from gaitswarm.services.optimizer.jobs.labels import ANY_JOB, JobFilter
from gaitswarm.views import PREFIX

_LIST: Final = f"{PREFIX}/jobs"

_OF_JOB: Final = re.compile(
    f"{_LIST}/([A-Za-z0-9_-]{{1,64}})(?:(/best)|(/iterations)(?:/([0-9]{{1,9}})/evaluations)?)?"
)


@dataclass(frozen=True, slots=True)
class _Route:
    """As much of a route as is told of a request.

    Attributes:
        path: Its template.
    """

    path: str


_JOBS: Final = _Route(_LIST)
_JOB: Final = _Route(f"{_LIST}/{{job_id}}")
_BEST: Final = _Route(f"{_LIST}/{{job_id}}/best")
_ITERATIONS: Final = _Route(f"{_LIST}/{{job_id}}/iterations")
_EVALUATIONS: Final = _Route(f"{_LIST}/{{job_id}}/iterations/{{iteration}}/evaluations")


class DirectAnswers:
    """Answers what is asked for most: pages of the list, a job, its best, what it has committed.

    The routes of the same paths answer the same, and say in the documentation what it is. What is
    asked for in another way than usual is left to them, as is all that they would refuse.
    """

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One ASGI exchange."""
        answer = None
        if scope["type"] == "http" and scope["method"] == "GET":
            path = scope["path"].removeprefix(scope.get("root_path", ""))
            if path.startswith(_LIST):
                try:
                    answer = await _answer(scope, path)
                except DOMAIN_ERRORS as error:
                    answer = await domain_problem(Request(scope), error)
        await (answer or self.app)(scope, receive, send)


async def _answer(scope: Scope, path: str) -> Response | None:
    """The answer; None if it is none of those that are given here."""
    query: bytes = scope["query_string"]
    if path == _LIST:
        listed = _job_list(query)
        if listed is None:
            return None
        scope["route"] = _JOBS
        found = await _page(scope, query, listed)
    else:
        match = _OF_JOB.fullmatch(path)
        question = None if match is None else _question(match, query)
        if match is None or question is None:
            return None
        scope["route"], asked = question
        found = await _of_job(scope, match[1], asked)
    return found.answer(Request(scope))


def _answers(scope: Scope) -> Answers:
    return cast(Answers, scope["state"]["answers"])


async def _of_job(scope: Scope, job_id: str, question: JobQuestion) -> Encoded:
    service, answers = service_of(scope), _answers(scope)
    job = service.store.at_once.job(job_id)
    known = None if job is None else question.known(answers, job)
    if known is not None:
        return known

    def answer() -> Encoded:
        return question.answer(answers, service, service.job(job_id) if job is None else job)

    return await run_sync(answer, limiter=_room(scope, prompt=job is not None))


async def _page(scope: Scope, query: bytes, listed: JobList) -> Encoded:
    service, answers = service_of(scope), _answers(scope)
    at_once = service.store.at_once
    # Before the page is read: what is committed meanwhile makes another version.
    version, key = at_once.version(), (at_once, query)
    known = None if version is None else answers.find_page(key, version)
    if known is not None:
        return known

    def answer() -> Encoded:
        page = listed.read(service)
        encoded = listed.encoded(answers, page)
        if version is not None and listed.lasts(page):
            answers.note_page(key, version, encoded)
        return encoded

    return await run_sync(answer, limiter=_room(scope, prompt=version is not None))


def _room(scope: Scope, *, prompt: bool) -> CapacityLimiter:
    """Few threads where none of them waits; some more where a server is asked."""
    name = "readings" if prompt else "waiting_readings"
    return cast(CapacityLimiter, scope["state"][name])


def _question(match: re.Match[str], query: bytes) -> tuple[_Route, JobQuestion] | None:
    _, best, iterations, index = match.groups()
    if iterations and index is None:
        asked = _iterations(query)
        return None if asked is None else (_ITERATIONS, asked)
    if query:
        return None
    if index is not None:
        return _EVALUATIONS, Evaluations(int(index))
    return (_BEST, Best()) if best else (_JOB, InFull())


def _parameters(query: bytes) -> dict[str, str] | None:
    """None where one comes twice."""
    if not query:
        return {}
    pairs = parse_qsl(query.decode("latin-1"), keep_blank_values=True)
    found = dict(pairs)
    return found if len(found) == len(pairs) else None


_NUMBER: Final = re.compile(r"[0-9]{1,9}")


def _number(text: str) -> int:
    """Raises ValueError."""
    if _NUMBER.fullmatch(text) is None:
        raise ValueError(text)
    return int(text)


def _iterations(query: bytes) -> Iterations | None:
    found = _read(query, {"after": _number, "limit": _number})
    if found is None or not 1 <= found.get("limit", 1) <= 1000:
        return None
    return Iterations(**found)


def _text(text: str) -> str:
    """Raises ValueError."""
    if len(text) > 200:
        raise ValueError(text)
    return text


def _job_list(query: bytes) -> JobList | None:
    found = _read(query, _OF_LIST)
    if found is None or not 1 <= found.get("limit", 1) <= 200:
        return None
    archived = found.pop("archived", None)
    where = ANY_JOB if archived is None else JobFilter(archived=archived)
    return JobList(where=where, **found)


_OF_LIST: Final[Mapping[str, Callable[[str], Any]]] = {
    "state": JobState,
    "order": JobOrder,
    "search": _text,
    "after": _text,
    "archived": {"true": True, "false": False}.__getitem__,
    "limit": _number,
}


def _read(query: bytes, readers: Mapping[str, Callable[[str], Any]]) -> dict[str, Any] | None:
    """Parameters by name; None where one is another, comes twice or is not as usual."""
    parameters = _parameters(query)
    if parameters is None:
        return None
    try:
        return {name: readers[name](text) for name, text in parameters.items()}
    except (LookupError, ValueError):
        return None
