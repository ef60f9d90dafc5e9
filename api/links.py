"""OpenAPI links: which operations go on with what another one answers."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any, Final

_SOURCES: Final[dict[str, dict[str, str]]] = {
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
"""What an answer tells, by parameter of the operations that it leads to."""

_ONLY: Final = {
    "list_jobs": frozenset({"get_job", "list_iterations"}),
    "list_iterations": frozenset({"list_evaluations", "get_preference_for"}),
}
"""Where an answer leads, if not to every operation that has one of its parameters in its path."""

_PARAMETER: Final = re.compile(r"\{(\w+)\}")


def add_links(document: dict[str, Any]) -> None:
    """Write the links into a document."""
    for source, told in _SOURCES.items():
        _, operation = _operations(document)[source]
        links = dict(_links(document, source, told))
        for status, response in operation["responses"].items():
            if status.startswith("2"):
                response["links"] = links


def _links(
    document: dict[str, Any], source: str, told: dict[str, str]
) -> Iterator[tuple[str, dict[str, Any]]]:
    for name, (path, operation) in _operations(document).items():
        wanted = set(_PARAMETER.findall(path))
        only = _ONLY.get(source)
        if not wanted or not wanted <= set(told) or (only is not None and name not in only):
            continue
        yield (
            name,
            {
                "operationId": name,
                "description": operation["summary"],
                "parameters": {parameter: told[parameter] for parameter in sorted(wanted)},
            },
        )


def _operations(document: dict[str, Any]) -> dict[str, tuple[str, dict[str, Any]]]:
    """Path and operation by id."""
    return {
        operation["operationId"]: (path, operation)
        for path, methods in document["paths"].items()
        for operation in methods.values()
    }
