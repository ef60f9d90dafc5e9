"""How a job names what evaluates its designs: a plug-in's case, or settings of one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, TypeAlias

from pydantic import BeforeValidator, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from gaitswarm.sim.case_registry import CASES, CaseFamily, CaseSettings
from gaitswarm.sim.plugins import PluginSettings


def _settings(choice: object) -> object:
    """Settings of a name, and a refusal of one that is none."""
    if isinstance(choice, str):
        choice = {"name": choice}
    if isinstance(choice, Mapping):
        name = choice.get("name")
        if isinstance(name, str) and name not in CASES:
            raise ValueError(CASES.unknown(name))
    elif choice is not None and not isinstance(choice, CaseSettings):
        raise ValueError("must be a name or an object: settings of a plug-in's case")
    return choice


def _model(family: CaseFamily) -> type[CaseSettings]:
    return family.settings


class _OrName:
    """A case's name in place of its settings, in schemas."""

    @staticmethod
    def __get_pydantic_json_schema__(
        schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        found, names = handler(schema), list(CASES)
        if not names:
            return found
        return {"anyOf": [{"type": "string", "enum": names}, *found["anyOf"]]}


if TYPE_CHECKING:
    CaseChoice: TypeAlias = CaseSettings | None
else:
    CaseChoice = Annotated[
        None, PluginSettings(CASES, _model, "/v1/cases"), BeforeValidator(_settings), _OrName()
    ]
"""What a job may say; once it is read, a name has become settings."""
