"""What jobs and walks of a robot have unless they say otherwise."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.preference import PreferenceName
from gaitswarm.sim.scenario import SCENARIOS

JOB_FILE: Final = "job.json"
"""In a robot's folder: what a job of this robot has unless it says otherwise."""

DEFAULT_CONTROLLER: Final = "fuzzy-pi"

DEFAULT_PREFERENCE: Final[PreferenceName] = "A"


@dataclass(frozen=True, slots=True)
class RobotDefaults:
    """Of a robot: what its folder says, and what a spec has where it says nothing.

    Attributes:
        document: Fields of a spec that the folder gives, unchecked; none for a shipped robot.
    """

    document: Mapping[str, Any] = field(default_factory=dict)

    @property
    def controller(self) -> str:
        """Motor controller, unchecked."""
        return str(self.document.get("controller", DEFAULT_CONTROLLER))

    @property
    def preference(self) -> Any:
        """How objectives are weighed: a name or an object, unchecked."""
        return self.document.get("preference", DEFAULT_PREFERENCE)

    @property
    def own_scenarios(self) -> dict[str, str | dict[str, Any]]:
        """The folder's walks by name, which may be a preset's number; empty if it has none."""
        found = self.document.get("scenarios", [])
        if not isinstance(found, list) or not all(isinstance(e, str | int | dict) for e in found):
            raise InvalidRequest(
                "its job.json must have a list under scenarios, of names, numbers or objects",
                field="robot",
            )
        entries = [str(e) if isinstance(e, int) else e for e in found]
        return {e if isinstance(e, str) else str(e.get("name")): e for e in entries}

    @property
    def scenarios(self) -> list[str | dict[str, Any]]:
        """All walks: the folder's, or the names of those of table 4.2."""
        return list(self.own_scenarios.values()) or [scenario.name for scenario in SCENARIOS]

    def of_controller(self, controller: object) -> dict[str, Any]:
        """What a job of this controller has."""
        if controller in (None, self.document.get("controller")):
            return dict(self.document)
        return {k: v for k, v in self.document.items() if k not in ("variables", "fixed")}


def robot_defaults(folder: str | os.PathLike[str]) -> RobotDefaults:
    """What the folder of a robot says that its jobs have."""
    path = Path(folder) / JOB_FILE
    if not path.is_file():
        return RobotDefaults()
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise InvalidRequest(f"cannot read {path}: {error}", field="robot") from error
    if not isinstance(document, dict):
        raise InvalidRequest(f"{path} must hold one JSON object", field="robot")
    return RobotDefaults(document)
