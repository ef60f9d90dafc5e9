"""Labels of jobs, and the facets by which jobs are values; results depend on neither"""

from __future__ import annotations

import json
import tomllib
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Annotated, Any, Final

from pydantic import BaseModel, ConfigDict, Field, StringConstraints

from gaitswarm.services.optimizer.jobs.preference import PREFERENCES
from gaitswarm.sim.input import Line, Lines
from gaitswarm.sim.robot.variant import SHIPPED

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
        """Return the changed labels."""
        name = labels.name if self.name is None else self.name.strip() or None
        return Labels(
            name=name,
            note=labels.note if self.note is None else self.note,
            tags=labels.tags if self.tags is None else tuple(dict.fromkeys(self.tags)),
        )


@dataclass(frozen=True, slots=True)
class JobFilter:
    """Criteria of a job list; None for any.

    Attributes:
        robot: name, or `own` for any custom robot.
        preference: name, or `own` for any other.
    """

    archived: bool | None = None
    robot: str | None = None
    controller: str | None = None
    preference: str | None = None
    tag: str | None = None

    @property
    def needs_specs(self) -> bool:
        """Whether it filters by more than `archived`."""
        return any((self.robot, self.controller, self.preference, self.tag))

    def admits(self, facets: Facets) -> bool:
        """Return whether a job with these facets passes.

        Args:
            facets: Of the job.
        """
        criteria = (self.robot, self.controller, self.preference)
        robot = OWN if self.robot == OWN and facets.own_robot else facets.robot
        values = (robot, facets.controller, facets.preference)
        return all(w is None or w == f for w, f in zip(criteria, values, strict=True)) and (
            self.tag is None or self.tag in facets.tags
        )


ANY_JOB: Final = JobFilter()


@dataclass(frozen=True, slots=True)
class Facets:
    """Properties by which a job is found."""

    state: str
    robot: str | None = None  # None if unnamed or unreadable
    controller: str | None = None  # None for a job that tunes none
    preference: str | None = None  # name, `own` for any other; None for none
    tags: tuple[str, ...] = ()
    own_robot: bool = False  # whether the robot is custom


@dataclass(slots=True)
class FacetCounts:
    """Number of jobs by value of each facet."""

    total: int = 0
    states: Counter[str] = field(default_factory=Counter)
    robots: Counter[str] = field(default_factory=Counter)
    controllers: Counter[str] = field(default_factory=Counter)
    preferences: Counter[str] = field(default_factory=Counter)
    tags: Counter[str] = field(default_factory=Counter)

    def add(self, facets: Facets) -> None:
        self.total += 1
        self.states[facets.state] += 1
        for counter, value in (
            (self.robots, facets.robot),
            (self.controllers, facets.controller),
            (self.preferences, facets.preference),
        ):
            if value is not None:
                counter[value] += 1
        self.tags.update(facets.tags)


def robot_name(robot: Any) -> str | None:
    """Return the name of a spec's robot."""
    document = _parsed(robot)
    if is_own_robot(document):
        return _name_in(str(_part(document, "toml")))
    if document is None or isinstance(document, str):
        return document or None
    return str(_part(document, "name") or OWN)


def is_own_robot(robot: Any) -> bool:
    """Return whether a spec's robot is custom."""
    return _part(_parsed(robot), "toml") is not None


def _part(robot: Any, name: str) -> Any:
    return robot.get(name) if isinstance(robot, Mapping) else getattr(robot, name, None)


@lru_cache(maxsize=256)
def _name_in(toml: str) -> str:
    """Cached: lists may hold many jobs of one robot."""
    try:
        name = tomllib.loads(toml).get("name")
    except (tomllib.TOMLDecodeError, RecursionError):
        return OWN
    return name if isinstance(name, str) and name and name not in SHIPPED else OWN


def preference_name(preference: Any) -> str | None:
    """Return the name of a spec's preference."""
    document = _parsed(preference)
    if not document:
        return None
    if isinstance(document, str):
        return document if document in PREFERENCES else OWN
    document = document if isinstance(document, Mapping) else vars(document)
    numbers = tuple(tuple(document.get(part) or ()) for part in ("bias", "exponent"))
    return next((n for n, p in PREFERENCES.items() if (p.bias, p.exponent) == numbers), OWN)


def _parsed(value: Any) -> Any:
    """Parse a JSON document; return any other value unchanged."""
    if isinstance(value, str) and value.startswith("{"):
        try:
            return json.loads(value)
        except ValueError:
            return None
    return value
