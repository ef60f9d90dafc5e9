"""The reference of the REST API, made from its OpenAPI document."""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import cache

from gaitswarm.api.document import document
from gaitswarm.api.problems import PROBLEMS
from scripts.manual.tables import Json, code, default_of, head, kind_of, row


def routes() -> Iterator[str]:
    """Every route with its parameters, body and answers, then the problems: lines of Markdown."""
    operations = [
        (f"{method.upper()} {path}", operation)
        for path, item in _document()["paths"].items()
        for method, operation in item.items()
    ]
    for tag in _document()["tags"]:
        yield f"\n## {tag['name']}\n\n{tag['description']}"
        for route, operation in operations:
            if operation["tags"] == [tag["name"]]:
                yield from _route(route, operation)
    yield "\n(problems)=\n## Types of problems\n"
    yield "`type` of a problem is `urn:gaitswarm:problem:` and one of these.\n"
    yield from head("type", "status", "title")
    for kind, (status, title) in sorted(PROBLEMS.items(), key=lambda entry: entry[1][0]):
        yield row([code(kind), str(status), title])


def schemas() -> Iterator[str]:
    """Every object of bodies and answers with its fields: lines of Markdown."""
    for name, schema in sorted(_document()["components"]["schemas"].items()):
        yield f"\n(schema-{name.lower()})=\n## {name}\n\n{schema.get('description', '')}\n"
        if "properties" not in schema:
            yield f"{kind_of(schema)}\n"
            continue
        yield from head("field", "type", "default", "meaning")
        for field, inner in schema["properties"].items():
            default = "required" if field in schema.get("required", ()) else default_of(inner)
            yield row([code(field), kind_of(inner), default, inner.get("description", "")])


@cache
def _document() -> Json:
    parsed: Json = json.loads(document())
    return parsed


def _route(route: str, operation: Json) -> Iterator[str]:
    yield f"\n(route-{operation['operationId']})=\n### {route}\n\n**{operation['summary']}.**"
    yield operation.get("description", "")
    if parameters := operation.get("parameters"):
        yield ""
        yield from head("parameter", "in", "type", "default", "meaning")
        for parameter in parameters:
            yield row(_parameter(parameter))
    if body := operation.get("requestBody"):
        optional = "" if body.get("required") else ", optional"
        yield f"\nBody: {_content(body['content'])}{optional}.\n"
    yield ""
    yield from head("status", "answer", "meaning")
    for status, answer in sorted(operation["responses"].items()):
        yield row([status, _content(answer.get("content", {})), answer["description"]])


def _parameter(parameter: Json) -> list[str]:
    schema = parameter["schema"]
    default = "required" if parameter["required"] else default_of(schema)
    meaning = parameter.get("description", "")
    return [code(parameter["name"]), parameter["in"], kind_of(schema), default, meaning]


def _content(content: Json) -> str:
    kinds = (
        kind_of(inner["schema"]) if "json" in name else code(name)
        for name, inner in content.items()
    )
    return " or ".join(kind for kind in kinds if kind)
