"""The manual's reference of REST and settings is complete: it is made from the code."""

from __future__ import annotations

import re
from typing import Any

import pytest

from gaitswarm.api.problems import PROBLEMS
from gaitswarm.sim.robot.description import RobotDescription
from scripts.manual.fields import models, settings
from scripts.manual.rest import routes, schemas
from tests.examples.api_document import api_document
from tests.setup import settings_classes


@pytest.fixture(scope="module")
def sections() -> dict[str, str]:
    """The reference of every route, by its heading."""
    text = "\n".join(routes())
    _, *parts = re.split(r"^###? ", text, flags=re.MULTILINE)
    return dict(part.split("\n", 1) for part in parts)


@pytest.fixture(scope="module")
def operations() -> dict[str, Any]:
    """Of the document, by what is their heading."""
    return {
        f"{method.upper()} {path}": operation
        for path, item in api_document()["paths"].items()
        for method, operation in item.items()
    }


def first_cells(text: str) -> list[str]:
    return [cell.strip("`") for cell in re.findall(r"^\| ([^|]+?) \|", text, re.MULTILINE)]


def test_every_route_is_in_it_once(sections: dict[str, str], operations: dict[str, Any]) -> None:
    assert set(operations) <= set(sections)
    headings = [line for line in routes() if re.search(r"^### ", line, re.MULTILINE)]
    assert len(headings) == len(operations)


def test_a_route_has_its_parameters_and_statuses(
    sections: dict[str, str], operations: dict[str, Any]
) -> None:
    for route, operation in operations.items():
        parameters = {parameter["name"] for parameter in operation.get("parameters", ())}
        documented = parameters | set(operation["responses"])
        assert documented - set(first_cells(sections[route])) == set(), route
        assert operation["summary"] in sections[route]


def test_every_type_of_problem_is_in_it_with_its_status(sections: dict[str, str]) -> None:
    rows = re.findall(r"^\| `([\w-]+)` \| (\d+) \|", sections["Types of problems"], re.MULTILINE)
    assert {kind: int(status) for kind, status in rows} == {
        kind: status for kind, (status, _) in PROBLEMS.items()
    }


def test_every_schema_that_is_referred_to_is_there() -> None:
    text = "\n".join([*routes(), *schemas()])
    assert set(re.findall(r"\(#(schema-\w+)\)", text)) <= set(
        re.findall(r"\((schema-\w+)\)=", text)
    )


def test_every_setting_is_in_it_with_its_meaning() -> None:
    rows = re.findall(
        r"^\| `(GAITSWARM_\w+)` \| ([^|]+) \| [^|]* \| \S", "\n".join(settings()), re.MULTILINE
    )
    assert {variable for variable, _ in rows} == settings_classes.variables()


def test_a_default_is_shown_as_the_variable_would_be_set() -> None:
    shown = dict(
        re.findall(r"^\| `(\w+)` \| [^|]+ \| `([^|]+)` \|", "\n".join(settings()), re.MULTILINE)
    )
    assert shown["GAITSWARM_CACHE"] == "true"
    assert shown["GAITSWARM_API_TRUSTED_PROXIES"] == "127.0.0.1,::1"
    assert shown["GAITSWARM_API_MAX_JOB_SECONDS"] == "10000000000"


def test_types_of_fields_are_shown_without_their_validators() -> None:
    text = "\n".join(models(RobotDescription))
    assert "Validator" not in text and r"`float \| None`" in text
