"""The reference of Pydantic models: files that people write, and settings of a process."""

from __future__ import annotations

import types
from collections.abc import Iterator
from functools import reduce
from operator import or_
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from gaitswarm.settings import Settings, variable_of
from gaitswarm.sim.input import Described, field_docstrings
from scripts.manual.tables import code, head, kind_of, row


def models(model: type[BaseModel]) -> Iterator[str]:
    """The fields of a model, and of the models within: lines of Markdown.

    Args:
        model: The outermost.
    """
    found: list[type[BaseModel]] = [model]
    for one in found:
        yield f"\n## {one.__name__}\n\n{(one.__doc__ or '').strip().splitlines()[0]}\n"
        yield from head("field", "type", "default", "meaning")
        described = one.descriptions() if issubclass(one, Described) else {}
        for name, field in one.model_fields.items():
            yield _row(name, field, described.get(name, ""))
            found += [inner for inner in _inner(field.annotation) if inner not in found]


def settings() -> Iterator[str]:
    """Every setting by the variable that it is read from: lines of Markdown."""
    yield from head("variable", "type", "default", "meaning")
    meanings = field_docstrings(Settings.__module__)[Settings.__name__]
    for name, schema in Settings.model_json_schema()["properties"].items():
        variable = code(variable_of(name))
        # Where a setting may be null, that is the variable that is not set.
        kind = kind_of(schema).removesuffix(" or null")
        yield row([variable, kind, _variable(schema.get("default")), meanings[name]])


def _variable(default: object) -> str:
    """A default as the variable would be set to it."""
    if isinstance(default, list):
        return code(",".join(default))
    if isinstance(default, float):
        return code(f"{default:.12g}")
    if isinstance(default, bool):
        return code(str(default).lower())
    return code("" if default is None else default)


def _row(name: str, field: FieldInfo, described: str) -> str:
    value = None if field.is_required() else field.get_default(call_default_factory=True)
    bare = _bare(field.annotation)
    kind = getattr(bare, "__name__", None) if not get_args(bare) else None
    shown = kind or str(bare).replace("typing.", "")
    for module in ("gaitswarm.sim.robot.description.", "collections.abc."):
        shown = shown.replace(module, "")
    default = code("" if value is None else value)
    return row([code(name), code(shown), default, field.description or described])


def _bare(annotation: Any) -> Any:
    """A type without what validates its values."""
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _bare(arguments[0])
    if origin is None or origin is Literal:
        return annotation
    if origin in (Union, types.UnionType):
        return reduce(or_, map(_bare, arguments))
    return origin[tuple(map(_bare, arguments))]


def _inner(annotation: Any) -> Iterator[type[BaseModel]]:
    """Models in an annotation."""
    if get_origin(annotation) is None:
        is_class = isinstance(annotation, type) and not isinstance(annotation, types.GenericAlias)
        if is_class and issubclass(annotation, BaseModel):
            yield annotation
    for part in get_args(annotation):
        yield from _inner(part)
