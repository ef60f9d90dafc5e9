"""Labels of jobs, and the facets by which jobs are values; results depend on neither"""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated, Final, NamedTuple

from pydantic import BaseModel, ConfigDict, Field, StringConstraints

from gaitswarm.services.optimizer.jobs.preference import PREFERENCES, Preference, PreferenceChoice
from gaitswarm.services.optimizer.views import View
from gaitswarm.sim.input import Line, Lines
from gaitswarm.sim.robot.variant import SHIPPED, RobotFiles, RobotSource, RobotVariant

OWN: Final = "own"
"""Facet value of custom preferences and unnamed robots."""

Tag = Annotated[Line, StringConstraints(strip_whitespace=True, min_length=1, max_length=40)]
JobName = Annotated[Line, StringConstraints(max_length=200)]
Note = Annotated[Lines, StringConstraints(max_length=10_000)]


class Labels(BaseModel):
    """Labels of a job, as stored."""

    model_config = ConfigDict(frozen=True)

    name: str | None = None
    note: str = ""
    tags: tuple[str, ...] = ()


class LabelsChange(BaseModel):
    """New labels for a job; omitted or null fields stay unchanged."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: JobName | None = Field(
        default=None,
        description="Shown instead of the spec's name; empty to show the spec's name again.",
        examples=["chapter 4, wider gains"],
    )
    note: Note | None = Field(
        default=None, description="Free text.", examples=["P lies at its bound"]
    )
    tags: tuple[Tag, ...] | None = Field(
        default=None, max_length=20, description="Words to find the job by.", examples=[["thesis"]]
    )
    archived: bool | None = Field(
        default=None, description="Whether lists hide the job by default; nothing is deleted."
    )

    def applied(self, labels: Labels) -> Labels:
        name = labels.name if self.name is None else self.name.strip() or None
        return Labels(
            name=name,
            note=labels.note if self.note is None else self.note,
            tags=labels.tags if self.tags is None else tuple(dict.fromkeys(self.tags)),
        )


class JobFilter(NamedTuple):
    """Criteria of a job list; None for any, `own` for a custom robot or preference."""

    archived: bool | None = None
    robot: str | None = None
    controller: str | None = None
    preference: str | None = None
    tag: str | None = None


ANY_JOB: Final = JobFilter()


class JobFacetsView(View):
    """Counts of jobs; those without robot, controller or preference count in the total only."""

    total: int = Field(description="Jobs in all [1].", examples=[1000])
    states: dict[str, int] = Field(description="By state [1].", examples=[{"succeeded": 12}])
    robots: dict[str, int] = Field(description="By name of the robot [1].")
    controllers: dict[str, int] = Field(description="By motor controller [1].")
    preferences: dict[str, int] = Field(description="By preference, `own` for any other [1].")
    tags: dict[str, int] = Field(description="By tag [1].", examples=[{"thesis": 3}])


def robot_name(robot: RobotSource | None) -> str | None:
    """Return the name of a spec's robot; `own` for a custom one without a name of its own."""
    if isinstance(robot, RobotFiles):
        return _name_in(robot.toml)
    return robot.name if isinstance(robot, RobotVariant) else robot


@lru_cache(maxsize=256)
def _name_in(toml: str) -> str:
    """Cached: lists may hold many jobs of one robot."""
    import tomllib

    try:
        name = tomllib.loads(toml).get("name")
    except (tomllib.TOMLDecodeError, RecursionError):
        return OWN
    return name if isinstance(name, str) and name and name not in SHIPPED else OWN


def preference_name(preference: PreferenceChoice | None) -> str | None:
    """Return the name of a spec's preference; `own` for a custom one."""
    if not isinstance(preference, Preference):
        return preference
    return next((name for name, shipped in PREFERENCES.items() if shipped == preference), OWN)
