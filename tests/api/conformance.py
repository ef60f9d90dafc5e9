"""`python -m tests.api.conformance --cases 10000`: a server keeps to its own OpenAPI document.

Every operation is sent values good and bad, made by schemathesis from the document, and sequences
of operations follow links from their answers. Nothing may be a 5xx, undocumented, or a traceback in
the log.
"""

from __future__ import annotations

import argparse
import itertools
import logging
import re
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, cast
from zlib import crc32

import hypothesis
import schemathesis
from hypothesis import HealthCheck, Phase, strategies
from hypothesis.errors import Flaky
from schemathesis.checks import CHECKS as ALL_CHECKS
from schemathesis.checks import load_all_checks
from schemathesis.config import SchemathesisConfig
from schemathesis.core.failures import FailureGroup
from schemathesis.engine.recorder import ScenarioRecorder
from schemathesis.generation.stateful.state_machine import APIStateMachine
from schemathesis.schemas import BaseSchema

from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.search.pso import PsoSettings
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store import Store, open_store
from gaitswarm.services.runtime import open_evaluator, run_embedded
from gaitswarm.sim.scenario import Scenario
from tests.certificate.examples import small
from tests.examples.servers import Server
from tests.examples.walks import SHORT_WALK

Case = schemathesis.Case[Any]

_LEFT_OUT: Final = {
    "ensure_resource_availability": "the best design of a job that was just made is 404",
    "ignored_auth": "wrong tokens are throttled; tests/api/test_access.py asks every operation",
    "object_level_authorization": "every token may read all jobs",
}
"""Checks that cannot hold, and why."""

load_all_checks()
CHECKS: Final = [
    check
    for check in ALL_CHECKS.get_all()
    if not isinstance(check, type) and check.__name__ not in _LEFT_OUT
]

_SOURCES: Final = {
    "submit_job": {"job_id": "$response.body#/id"},
    "fork_job": {"job_id": "$response.body#/id"},
    "list_jobs": {"job_id": "$response.body#/items/0/id"},
    "list_iterations": {
        "job_id": "$request.path.job_id",
        "iteration": "$response.body#/items/0/index",
    },
    "list_recordings": {"recording_id": "$response.body#/items/0/id"},
    "add_recording": {"recording_id": "$response.body#/id"},
    "record_measured_walk": {"recording_id": "$response.body#/recording/id"},
}
"""OpenAPI links: parameters of other operations that a response contains."""

_ONLY: Final = {
    "list_jobs": frozenset({"get_job", "list_iterations"}),
    "list_iterations": frozenset({"list_evaluations", "get_preference_for"}),
}
"""Targets of links, if not every operation with one of the parameters in its path."""

_PARAMETER: Final = re.compile(r"\{(\w+)\}")

_STEPS: Final = 12
"""Requests of a sequence."""

_OF_SEQUENCES: Final = 0.3
"""Share of all cases."""


@dataclass
class Found:
    """What came of a campaign.

    Attributes:
        answers: how many there were, by operation and status.
        failures: how often each check failed on which operation, with the first request that did.
        tracebacks: that the server logged.
        seconds: that all requests took together [s].
    """

    answers: Counter[tuple[str, int]] = field(default_factory=Counter)
    failures: dict[tuple[str, str], list[str]] = field(default_factory=dict)
    tracebacks: list[str] = field(default_factory=list)
    seconds: float = 0.0

    @property
    def cases(self) -> int:
        """Requests that were sent."""
        return self.answers.total()

    def send(self, case: Case, url: str) -> schemathesis.Response:
        """Send a case, and remember what is wrong with its answer."""
        begun = time.perf_counter()
        response = case.call(base_url=url)
        self.seconds += time.perf_counter() - begun
        self.look_at(case, response)
        return response

    def look_at(
        self, case: Case, response: schemathesis.Response, recorder: ScenarioRecorder | None = None
    ) -> None:
        """Remember an answer, and what is wrong with it."""
        label = case.operation.label
        self.answers[label, response.status_code] += 1
        try:
            case.validate_response(response, checks=CHECKS, recorder=recorder)
        except FailureGroup as group:
            for failure in group.exceptions:
                said = f"{case.as_curl_command()}\n{response.status_code} {response.text[:500]}"
                known = self.failures.setdefault((label, type(failure).__name__), [])
                known.append(f"{failure}\n{said}" if not known else "")


@contextmanager
def served() -> Iterator[tuple[Server, dict[str, list[str]]]]:
    """A server with short limits on simulations, and finished jobs of three kinds.

    Yields:
        The server, and ids of what it has, by parameter of a path.
    """
    with tempfile.TemporaryDirectory() as folder:
        store = open_store(str(Path(folder) / "jobs.db"))
        service = JobService(store, longest_job=1e10)
        server = Server(
            service,
            api_max_simulated_seconds=3.0,
            api_max_logged_seconds=2.0,
            api_max_sampled_seconds=30.0,
        )
        try:
            yield server, {"job_id": _jobs(store, service)}
        finally:
            server.close()
            store.close()


_GOOD_JOB: Final = JobSpec(
    controller="pi",
    scenarios=(Scenario(**SHORT_WALK),),
    optimizer=PsoSettings(particles=4),
    iterations=3,
)


def _jobs(store: Store, service: JobService) -> list[str]:
    found = [service.submit(spec)[0].id for spec in (_GOOD_JOB, small())]
    evaluator = open_evaluator("in-process", cpus=2)
    try:
        for job_id in found:
            run_embedded(store, evaluator, job_id)
    finally:
        evaluator.close()
    return found


def _add_links(document: dict[str, Any]) -> None:
    for source, parameters in _SOURCES.items():
        _, operation = _operations(document)[source]
        links = dict(_links(document, source, parameters))
        for status, response in operation["responses"].items():
            if status.startswith("2"):
                response["links"] = links


def _links(
    document: dict[str, Any], source: str, parameters: dict[str, str]
) -> Iterator[tuple[str, dict[str, Any]]]:
    for name, (path, operation) in _operations(document).items():
        path_names = set(_PARAMETER.findall(path))
        only = _ONLY.get(source)
        if not path_names or not path_names <= set(parameters):
            continue
        if only is not None and name not in only:
            continue
        yield (
            name,
            {
                "operationId": name,
                "description": operation["summary"],
                "parameters": {key: parameters[key] for key in sorted(path_names)},
            },
        )


def _operations(document: dict[str, Any]) -> dict[str, tuple[str, dict[str, Any]]]:
    """Return path and operation by id."""
    return {
        operation["operationId"]: (path, operation)
        for path, methods in document["paths"].items()
        for operation in methods.values()
    }


def config() -> SchemathesisConfig:
    """Settings of schemas: text of all characters but surrogates, and statuses that are right."""
    config = SchemathesisConfig()
    project = config.projects.default
    # A codec is asked for its characters one by one: five seconds in a new checkout.
    project.generation.codec = None
    # Rules between fields, and limits of this server, are beyond a schema.
    project.checks.positive_data_acceptance.expected_statuses.append("422")
    # Text that is too long may make the whole body too large.
    project.checks.negative_data_rejection.expected_statuses.append("413")
    return config


def schema_of(server: Server, ids: dict[str, list[str]]) -> BaseSchema:
    """The document of a server; half of all paths name something that there is.

    Half of all valid jobs submitted are a good one, which values by chance almost never are, so
    that sequences have a job of their own to go on with.
    """
    # Made at the first request, which takes long on a busy machine.
    document = server.client.get("/openapi.json", timeout=300.0).json()
    _add_links(document)
    # Streams end with their jobs only, and are tested apart.
    schema = schemathesis.openapi.from_dict(document, config=config()).exclude(
        operation_id="stream_events"
    )
    good = _GOOD_JOB.model_dump(mode="json")

    @schema.hook
    def map_path_parameters(
        _: schemathesis.HookContext, path_parameters: dict[str, Any] | None
    ) -> dict[str, Any] | None:
        for name, known in ids.items():
            drawn = crc32(repr((path_parameters or {}).get(name)).encode()) % (2 * len(known))
            if path_parameters and name in path_parameters and drawn < len(known):
                path_parameters[name] = known[drawn]
        return path_parameters

    @schema.hook
    def map_case(_: schemathesis.HookContext, case: Case) -> Case:
        submits = case.operation.label == "POST /v1/jobs"
        if submits and case.meta and case.meta.generation.mode.is_positive:
            case.body = good if crc32(repr(case.body).encode()) % 2 else case.body
        return case

    return schema


def single_requests(schema: BaseSchema, url: str, found: Found, each: int, seed: int) -> None:
    """Send every operation so many requests, half of them with something wrong.

    Args:
        schema: of the server.
        url: of the server.
        found: takes on what comes of it.
        each: requests of an operation.
        seed: of their values.
    """
    modes = (schemathesis.GenerationMode.POSITIVE, schemathesis.GenerationMode.NEGATIVE)
    for result in schema.get_all_operations():
        operation = result.ok()  # type: ignore[union-attr] # the document is valid

        def send(case: Case) -> None:
            found.send(case, url)

        wanted = strategies.one_of(*(operation.as_strategy(generation_mode=m) for m in modes))
        test = hypothesis.settings(_SETTINGS, max_examples=each)(hypothesis.given(wanted)(send))
        hypothesis.seed(seed)(test)()


_SETTINGS: Final = hypothesis.settings(
    deadline=None,
    database=None,
    phases=[Phase.generate],
    suppress_health_check=list(HealthCheck),
)


def sequences(schema: BaseSchema, url: str, found: Found, cases: int) -> None:
    """Send sequences of requests along links, from answers to the paths of other operations.

    Args:
        schema: of the server.
        url: of the server.
        found: takes on what comes of it.
        cases: requests in all, at least.
    """

    class Sequence(schema.as_state_machine()):  # type: ignore[misc]
        def get_call_kwargs(self, case: Case) -> dict[str, Any]:
            return {"base_url": url}

        def validate_response(self, response: Any, case: Case, **_: Any) -> None:
            found.look_at(case, response, self.recorder)

    machine = cast(type[APIStateMachine], Sequence)
    end = found.cases + cases
    while found.cases < end:
        count = max(1, (end - found.cases) // _STEPS)
        # What can follow depends on the server's answers, which hypothesis does not expect to be
        # others when it draws a sequence again.
        with suppress(Flaky):
            machine.run(
                settings=hypothesis.settings(
                    _SETTINGS, max_examples=count, stateful_step_count=_STEPS
                )
            )


class _Tracebacks(logging.Handler):
    """Collects unexpected exceptions from the server's log."""

    def __init__(self, found: Found) -> None:
        super().__init__(logging.ERROR)
        self._found = found

    def emit(self, record: logging.LogRecord) -> None:
        if record.exc_info:
            self._found.tracebacks.append(self.format(record))


def campaign(cases: int, seed: int, minutes: float = 0.0) -> Found:
    """Send a server of its own at least so many requests, again and again until the time is over.

    Args:
        cases: of a round.
        seed: of the values of single requests, one more each round; sequences are other ones every
            time.
        minutes: for which rounds begin; there is one at least.
    """
    found, ends = Found(), time.monotonic() + 60.0 * minutes
    log = logging.getLogger("gaitswarm")
    handler = _Tracebacks(found)
    log.addHandler(handler)
    try:
        with served() as (server, ids):
            schema = schema_of(server, ids)
            operations = sum(1 for _ in schema.get_all_operations())
            each = max(1, round((1.0 - _OF_SEQUENCES) * cases / operations))
            for number in itertools.count(1):
                single_requests(schema, server.url, found, each, seed + number - 1)
                sequences(schema, server.url, found, max(1, number * cases - found.cases))
                if time.monotonic() >= ends:
                    break
    finally:
        log.removeHandler(handler)
    return found


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a campaign and print what came of it; 1 if anything is not as documented."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=10_000, help="of a round")
    parser.add_argument("--minutes", type=float, default=0.0, help="further rounds for so long")
    parser.add_argument("--seed", type=int, default=1, help="another one, other cases")
    options = parser.parse_args(arguments)
    begun = time.perf_counter()
    found = campaign(options.cases, options.seed, options.minutes)
    elapsed = time.perf_counter() - begun
    statuses = Counter[int]()
    for (label, status), count in sorted(found.answers.items()):
        statuses[status] += count
        print(f"{label:60} {status} {count}")  # noqa: T201
    print(f"{found.cases} cases in {elapsed:.0f} s: {dict(sorted(statuses.items()))}")  # noqa: T201
    for (label, check), (first, *more) in found.failures.items():
        print(f"\n{label}: {check}, {1 + len(more)} times\n{first}")  # noqa: T201
    for text in found.tracebacks:
        print(f"\n{text}")  # noqa: T201
    return 1 if found.failures or found.tracebacks else 0


if __name__ == "__main__":
    raise SystemExit(main())
