"""Settings in documents, of models that plug-ins bring."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Generic, TypeVar

from pydantic import BaseModel, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

from gaitswarm.sim.plugins.registry import Registry

T = TypeVar("T")


class PluginSettings(Generic[T]):
    """Annotation of settings that may be a plug-in's: what is annotated is read if they are not."""

    def __init__(
        self, registry: Registry[T], model: Callable[[T], type[BaseModel]], seen: str
    ) -> None:
        self._registry, self._model, self._seen = registry, model, seen

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        """Reads settings by the model of their name; writes all that a model has."""
        return core_schema.no_info_wrap_validator_function(
            self._read, handler(source), serialization=core_schema.simple_ser_schema("any")
        )

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        """What is annotated, or settings with one of the names that plug-ins have here."""
        found = handler(schema)
        names = [name for name in self._registry if name not in self._registry.built_in]
        if not names:
            return found
        own = {
            "title": "PluginSettings",
            "type": "object",
            "properties": {"name": {"type": "string", "enum": names}},
            "required": ["name"],
            "description": f"Settings of a plug-in's {self._registry.kind}; {self._seen} has them.",
        }
        for union in ("oneOf", "anyOf"):
            if union in found:
                return {**found, union: [*found[union], own]}
        return {"anyOf": [found, own]}

    def _read(self, value: Any, otherwise: Callable[[Any], Any]) -> Any:
        if isinstance(value, Mapping):
            name = value.get("name")
        else:
            name = getattr(value, "name", None) if isinstance(value, BaseModel) else None
        if not isinstance(name, str) or name in self._registry.built_in:
            return otherwise(value)
        if name not in self._registry:
            return otherwise(value)
        return self._model(self._registry[name]).model_validate(value)
