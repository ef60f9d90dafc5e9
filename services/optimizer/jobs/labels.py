"""What people write on a job, and by what they find it; none of it determines results."""

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
from gaitswarm.sim.robot.variant import SHIPPED

OWN: Final = "own"
"""What a preference is called that is none of those shipped, and a robot that says no name."""

Tag = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=40)]
JobName = Annotated[str, StringConstraints(max_length=200)]
Note = Annotated[str, StringConstraints(max_length=10_000)]


class Labels(BaseModel):
    """Labels of a job as they are stored."""

    model_config = ConfigDict(frozen=True)

    name: str | None = None
    note: str = ""
    tags: tuple[str, ...] = ()


class LabelsChange(BaseModel):
    """Other labels for a job; what is left out, or null, stays as it is."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: JobName | None = Field(
        default=None,
        description="Shown in place of the spec's name, which stays as it is; empty to show that"
        " again.",
        examples=["chapter 4, wider gains"],
    )
    note: Note | None = Field(
        default=None, description="Text of any kind.", examples=["P lies at its bound"]
    )
    tags: tuple[Tag, ...] | None = Field(
        default=None, max_length=20, description="Words to find it by.", examples=[["thesis"]]
    )
    archived: bool | None = Field(
        default=None, description="Whether it is out of the way in lists; nothing is deleted."
    )

    def applied(self, labels: Labels) -> Labels:
        """Change labels."""
        name = labels.name if self.name is None else self.name.strip() or None
        return Labels(
            name=name,
            note=labels.note if self.note is None else self.note,
            tags=labels.tags if self.tags is None else tuple(dict.fromkeys(self.tags)),
        )


@dataclass(frozen=True, slots=True)
class JobFilter:
    """Which jobs are wanted; None for any.

    Attributes:
        archived: Whether they are archived.
        robot: Name of their robot, `own` for any of their users'.
        controller: Motor controller that they tune.
        preference: Name of their preference, `own` for any other.
        tag: One of their tags.
    """

    archived: bool | None = None
    robot: str | None = None
    controller: str | None = None
    preference: str | None = None
    tag: str | None = None

    @property
    def needs_specs(self) -> bool:
        """Whether it asks for more than whether jobs are archived."""
        return any((self.robot, self.controller, self.preference, self.tag))

    def admits(self, facets: Facets) -> bool:
        """Say whether a job is wanted, as far as its facets tell.

        Args:
            facets: Of the job.

        Returns:
            Whether it is.
        """
        wanted = (self.robot, self.controller, self.preference)
        robot = OWN if self.robot == OWN and facets.own_robot else facets.robot
        found = (robot, facets.controller, facets.preference)
        return all(w is None or w == f for w, f in zip(wanted, found, strict=True)) and (
            self.tag is None or self.tag in facets.tags
        )


ANY_JOB: Final = JobFilter()


@dataclass(frozen=True, slots=True)
class Facets:
    """What a job is found by.

    Attributes:
        state: Of the job.
        robot: Its name; None where it has none, or cannot be read.
        controller: That it tunes; None for none.
        preference: Its name, `own` for any other; None for none.
        tags: Of the job.
        own_robot: Whether the robot is a user's own.
    """

    state: str
    robot: str | None = None
    controller: str | None = None
    preference: str | None = None
    tags: tuple[str, ...] = ()
    own_robot: bool = False


@dataclass(slots=True)
class FacetCounts:
    """How many jobs there are of each value of each facet.

    Attributes:
        total: Jobs in all.
        states: By state.
        robots: By robot.
        controllers: By controller.
        preferences: By preference.
        tags: By tag.
    """

    total: int = 0
    states: Counter[str] = field(default_factory=Counter)
    robots: Counter[str] = field(default_factory=Counter)
    controllers: Counter[str] = field(default_factory=Counter)
    preferences: Counter[str] = field(default_factory=Counter)
    tags: Counter[str] = field(default_factory=Counter)

    def add(self, facets: Facets) -> None:
        """Count a job."""
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
    """Name the robot of a spec."""
    known = _parsed(robot)
    if is_own_robot(known):
        return _name_in(str(_part(known, "toml")))
    if known is None or isinstance(known, str):
        return known or None
    return str(_part(known, "name") or OWN)


def is_own_robot(robot: Any) -> bool:
    """Say whether the robot of a spec is a user's own."""
    return _part(_parsed(robot), "toml") is not None


def _part(robot: Any, name: str) -> Any:
    return robot.get(name) if isinstance(robot, Mapping) else getattr(robot, name, None)


@lru_cache(maxsize=256)
def _name_in(toml: str) -> str:
    """Of lists with many jobs of one robot it is read once."""
    try:
        name = tomllib.loads(toml).get("name")
    except (tomllib.TOMLDecodeError, RecursionError):
        return OWN
    return name if isinstance(name, str) and name and name not in SHIPPED else OWN


def preference_name(preference: Any) -> str | None:
    """Name the preference of a spec."""
    known = _parsed(preference)
    if not known:
        return None
    if isinstance(known, str):
        return known if known in PREFERENCES else OWN
    document = known if isinstance(known, Mapping) else vars(known)
    numbers = tuple(tuple(document.get(part) or ()) for part in ("bias", "exponent"))
    return next((n for n, p in PREFERENCES.items() if (p.bias, p.exponent) == numbers), OWN)


def _parsed(value: Any) -> Any:
    """A document of its text; any other value as it is."""
    if isinstance(value, str) and value.startswith("{"):
        try:
            return json.loads(value)
        except ValueError:
            return None
    return value
