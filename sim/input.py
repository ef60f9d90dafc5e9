"""Validation of user input: alternatives, keys and error messages."""

from __future__ import annotations

import ast
import inspect
import re
import sys
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from itertools import pairwise
from types import UnionType
from typing import Annotated, Any, Final, Union, get_args, get_origin

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Discriminator,
    GetJsonSchemaHandler,
    Tag,
    TypeAdapter,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema
from pydantic_core.core_schema import no_info_plain_validator_function

from gaitswarm.sim.near_names import instead_of, nearest

Location = Sequence[str | int]

NAME: Final = "<name>"
OWN: Final = "<own>"

_KEY: Final = "[key]"
"""Appended by pydantic if the key of a dictionary is wrong, not its value."""


@cache
def field_docstrings(module: str) -> Mapping[str, Mapping[str, str]]:
    """Docstrings below the fields of a module's classes, each in one line."""
    try:
        source = inspect.getsource(sys.modules[module])
    except (KeyError, OSError, TypeError):
        # There is no file, as in an interpreter.
        return {}
    return {
        model.name: {
            field.target.id: " ".join(text.value.value.split())
            for field, text in pairwise(model.body)
            if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name)
            if isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant)
            if isinstance(text.value.value, str)
        }
        for model in ast.parse(source).body
        if isinstance(model, ast.ClassDef)
    }


class Described(BaseModel):
    """A model whose longer descriptions of fields are docstrings below them.

    They are read for JSON schemas alone: Pydantic would read them at every start.
    """

    @classmethod
    def __get_pydantic_json_schema__(
        cls, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        document = handler(schema)
        properties = handler.resolve_ref_schema(document)["properties"]
        for name, text in cls.descriptions().items():
            if name in properties:
                properties[name].setdefault("description", text)
        return document

    @classmethod
    def descriptions(cls) -> dict[str, str]:
        """Descriptions of the fields, by name."""
        texts: dict[str, str] = {}
        for base in reversed(cls.__mro__[: cls.__mro__.index(Described)]):
            texts |= field_docstrings(base.__module__).get(base.__name__, {})
        given = cls.model_fields.items()
        return texts | {name: field.description for name, field in given if field.description}


class Data(Described):
    """Immutable data without unknown fields or infinities."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)


def _printable(text: str) -> str:
    if not text.isprintable():
        raise ValueError("must contain only printable characters")
    return text


def _printable_lines(text: str) -> str:
    for line in text.replace("\r\n", "\n").replace("\t", " ").split("\n"):
        _printable(line)
    return text


Line = Annotated[str, AfterValidator(_printable)]
"""Text that a terminal or a log prints as it is."""

Lines = Annotated[str, AfterValidator(_printable_lines)]
"""The same with line breaks and tabs."""


def check_distinct(field: str, names: Sequence[object]) -> None:
    """Raise ValueError, which names the field, if one of the names occurs twice."""
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"{field}: {name!r} is named twice")


def alternatives(
    expected: str, *, among_own: Callable[[Any], str] = lambda _: OWN
) -> Discriminator:
    def tag(value: Any) -> str | None:
        if isinstance(value, str):
            return NAME
        return among_own(value) if isinstance(value, Mapping | BaseModel) else None

    return Discriminator(tag, custom_error_type="no_choice", custom_error_message=expected)


@dataclass(frozen=True, slots=True)
class Imported:
    """A model as an annotation, which is imported when a value is validated."""

    module: str
    name: str

    @property
    def model(self) -> type[BaseModel]:
        """The model."""
        found: type[BaseModel] = getattr(import_module(self.module), self.name)
        return found

    def _validate(self, value: Any) -> BaseModel:
        return self.model.model_validate(value)

    def __get_pydantic_core_schema__(self, *_: Any) -> CoreSchema:
        return no_info_plain_validator_function(self._validate)

    def __get_pydantic_json_schema__(
        self, _: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        return handler(TypeAdapter(self.model).core_schema)


def without_tags(location: Location) -> tuple[str | int, ...]:
    return tuple(part for part in location if not is_tag(part))


def is_tag(part: str | int) -> bool:
    return isinstance(part, str) and (part == _KEY or (part[:1] == "<" and part[-1:] == ">"))


_PLAIN: Final = {
    "missing": "is missing",
    "extra_forbidden": "unknown key; remove it",
    "int_type": "must be a whole number",
    "int_parsing": "must be a whole number",
    "int_from_float": "must be a whole number",
    "int_parsing_size": "is too large",
    "float_type": "must be a number",
    "float_parsing": "must be a number",
    "finite_number": "must be a finite number",
    "bool_type": "must be true or false",
    "bool_parsing": "must be true or false",
    "string_type": "must be a string",
    "list_type": "must be a list",
    "tuple_type": "must be a list",
    "dict_type": "must be an object",
    "model_type": "must be an object",
    "model_attributes_type": "must be an object",
    "dataclass_type": "must be an object",
    "none_required": "must be null",
    "datetime_parsing": "must be a time, such as 2026-01-31T12:00:00Z",
    "datetime_type": "must be a time, such as 2026-01-31T12:00:00Z",
    "datetime_from_date_parsing": "must be a time, such as 2026-01-31T12:00:00Z",
    "greater_than": "must be greater than {gt}",
    "greater_than_equal": "must be at least {ge}",
    "less_than": "must be less than {lt}",
    "less_than_equal": "must be at most {le}",
    "multiple_of": "must be a multiple of {multiple_of}",
    "too_short": "must have at least {min_length} items, not {actual_length}",
    "too_long": "must have at most {max_length} items, not {actual_length}",
    "string_too_short": "must have at least {min_length} characters",
    "string_too_long": "must have at most {max_length} characters",
    "string_pattern_mismatch": "must match the pattern {pattern}",
    "union_tag_invalid": "{discriminator} must be one of {expected_tags}",
    "literal_error": "must be {expected}",
    "enum": "must be {expected}",
}
"""Messages by pydantic's type of error, with placeholders from its context."""


def message_of(error: Mapping[str, Any]) -> str:
    kind, context = error["type"], error.get("ctx", {})
    if kind == "extra_forbidden" and "known" in context:
        key, inner = str(error["loc"][-1]), context["inner"]
        own = nearest(key, context["known"])
        elsewhere = inner.get(key if key in inner or own else nearest(key, inner))
        if elsewhere is not None:
            return f"unknown key; did you mean {elsewhere!r}?"
        return f"unknown key; {instead_of(key, context['known'])}"
    if kind == "literal_error" and isinstance(error.get("input"), str):
        near = nearest(error["input"], re.findall(r"'([^']*)'", context["expected"]))
        return f"must be {context['expected']}{f'; did you mean {near!r}?' if near else ''}"
    if kind in _PLAIN:
        return _PLAIN[kind].format_map({name: _number(value) for name, value in context.items()})
    message = str(error["msg"]).removeprefix("Value error, ")
    return message.replace("Input should be", "must be").replace("Input should", "must")


def with_known_keys(
    errors: Sequence[Mapping[str, Any]], model: Any
) -> tuple[Mapping[str, Any], ...]:
    # An object may have thousands of unknown keys.
    @cache
    def context(container: tuple[str | int, ...]) -> dict[str, Any] | None:
        known = {
            name: kind for node in _models_at(model, container) for name, kind in _fields(node)
        }
        return {"known": [*known], "inner": _inner_keys(known)} if known else None

    return tuple(
        {**error, "ctx": keys}
        if error["type"] == "extra_forbidden" and (keys := context(error["loc"][:-1]))
        else error
        for error in errors
    )


def _number(value: object) -> object:
    return f"{value:g}" if isinstance(value, float) else value


def description_of(model: Any, location: Sequence[str | int]) -> str | None:
    """Return the description of the field at a location in a model's document, if it has one."""
    name = str(location[-1]) if location else ""
    models = (node for node in _models_at(model, location[:-1]) if issubclass(node, Described))
    return next((m.descriptions().get(name) for m in models if name in m.model_fields), None)


def _models_at(model: Any, location: Sequence[str | int]) -> list[type[BaseModel]]:
    reached = [model]
    for part in location:
        reached = [inner for one in reached for inner in _inner(one, part)]
    return [one for node in reached for _, one in _alternatives(node) if _is_model(one)]


def _inner_keys(known: Mapping[str, Any]) -> dict[str, str]:
    """Paths of the fields of nested objects by their names; the first of duplicates."""
    paths: dict[str, str] = {}
    for outer, annotation in known.items():
        for name, _ in _fields(annotation):
            paths.setdefault(name, f"{outer}.{name}")
    return paths


def _fields(annotation: Any) -> Iterator[tuple[str, Any]]:
    """Yield (name, annotation) of the fields of a model, or of every model of a union."""
    for _, one in _alternatives(annotation):
        if _is_model(one):
            yield from ((name, field.annotation) for name, field in one.model_fields.items())


def _inner(annotation: Any, part: str | int) -> Iterator[Any]:
    for tag, one in _alternatives(annotation):
        if tag is not None and tag == part:
            yield one
        elif _is_model(one):
            if part in one.model_fields:
                yield one.model_fields[part].annotation
        elif get_args(one) and not (isinstance(part, str) and is_tag(part)):
            # The last argument is a mapping's value, or the items of a list or tuple.
            yield [kind for kind in get_args(one) if kind is not ...][-1]


def _alternatives(annotation: Any, tag: str | None = None) -> Iterator[tuple[str | None, Any]]:
    """Yield (tag, annotation) of every member of a union, or of the annotation itself."""
    origin = get_origin(annotation)
    if origin is Annotated:
        inner, *extra = get_args(annotation)
        own = next((entry.tag for entry in extra if isinstance(entry, Tag)), tag)
        inner = next((entry.model for entry in extra if isinstance(entry, Imported)), inner)
        yield from _alternatives(inner, own)
    elif origin in (Union, UnionType):
        for member in get_args(annotation):
            yield from _alternatives(member, tag)
    else:
        yield tag, annotation


def _is_model(annotation: Any) -> bool:
    return isinstance(annotation, type) and issubclass(annotation, BaseModel)


def unique_names(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return an object of a JSON document; raise ValueError if a name occurs twice in it."""
    names = dict(pairs)
    if len(names) < len(pairs):
        counts = Counter(name for name, _ in pairs)
        raise ValueError(f"{counts.most_common(1)[0][0]!r} occurs twice in one object")
    return names


def numbers_from_booleans(document: Any, value: Any) -> Iterator[tuple[str | int, ...]]:
    """Yield where a document has true or false, of which validation has made a number."""
    if isinstance(document, bool):
        if type(value) in (int, float):
            yield ()
        return
    pairs: Iterable[tuple[str | int, Any, Any]] = ()
    if isinstance(document, dict) and isinstance(value, dict):
        pairs = ((name, document[name], value[name]) for name in document.keys() & value.keys())
    elif isinstance(document, list | tuple) and isinstance(value, list | tuple):
        pairs = ((i, *both) for i, both in enumerate(zip(document, value, strict=False)))
    for name, part, inner in pairs:
        for where in numbers_from_booleans(part, inner):
            yield (name, *where)
