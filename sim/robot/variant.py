"""Robots in jobs: shipped ones, variants of them, and robot files."""

from __future__ import annotations

import hashlib
import math
from dataclasses import replace
from functools import lru_cache
from importlib import resources
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, TypeAlias, get_args

from pydantic import BaseModel, ConfigDict, Field, Tag, model_validator

from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.input import NAME, Data, alternatives
from gaitswarm.sim.robot.bounds import (
    DEEPEST,
    LONGEST_TOML,
    LONGEST_URDF,
    MOST_ELEMENTS,
    MOST_LEGS,
    MOST_LINKS,
    MOST_VALUES,
    ContactLaw,
    PlannedSoles,
)

if TYPE_CHECKING:
    from gaitswarm.sim.robot.description import AnyActuator, Leg
    from gaitswarm.sim.robot.robot import Robot


def digest_of(toml: str, urdf: str) -> bytes:
    # Invalid Unicode is rejected later, by name.
    texts = (text.encode(errors="surrogatepass") for text in (toml, urdf))
    return hashlib.sha256(b"%d " % len(toml) + b"".join(texts)).digest()


@lru_cache(maxsize=1024)
def checks_of(digest: bytes) -> set[Literal["passed", "read"]]:
    """Return the checks that files have passed in this process, to which callers add.

    passed: that of `gaitswarm.sim.robot.check.check_files`; read: a robot was built from them.
    """
    del digest
    return set()


RobotName = Literal["szabadka2", "szabadka2-identified", "szabadka2-reconstructed"]
"""Robots shipped with gaitswarm."""

DEFAULT_ROBOT: Final[RobotName] = "szabadka2-reconstructed"
"""Default robot, on which published results are based."""

SHIPPED: Final[tuple[RobotName, ...]] = get_args(RobotName)


@lru_cache(maxsize=8)
def shipped_robot(name: str) -> Robot:
    """Load a robot that ships with gaitswarm."""
    import tomllib

    from gaitswarm.sim.robot.identifiable import with_parameters
    from gaitswarm.sim.robot.robot import parse_robot

    if name not in SHIPPED:
        raise SimulationInputError(f"robot: unknown {name!r}; known are {', '.join(SHIPPED)}")
    folder = resources.files("gaitswarm.sim.robot") / name
    parameters = folder / "parameters.toml"
    if not parameters.is_file():
        robot = parse_robot(
            (folder / "robot.toml").read_text(encoding="utf-8"),
            (folder / "robot.urdf").read_text(encoding="utf-8"),
        )
        return replace(robot, ships=True)
    document = tomllib.loads(parameters.read_text(encoding="utf-8"))
    robot = with_parameters(shipped_robot(document["base"]), document["parameters"])
    texts = {field: document[field] for field in ("name", "description")}
    return replace(robot, description=robot.description.model_copy(update=texts))


Degrees = tuple[float, float, float]


class RobotVariant(Data):
    """A shipped robot, modelled in more detail than by default."""

    name: RobotName = Field(default=DEFAULT_ROBOT, description="Robot to start from.")
    contact_law: ContactLaw | None = None
    """Friction law of the soles: linear_zone, karnopp, stick or dead_zone; null is the robot's own
    law."""
    backlash: Degrees = Field(default=(0.0, 0.0, 0.0), examples=[(2.5, 1.0, 1.0)])
    """Backlash between gearhead and link of coxa, femur and tibia, end to end [deg]; measured at 2
    to 3 on the robot. Simulated at 40 kHz, so eight times slower."""
    planned_soles: PlannedSoles | None = None
    """Sole lengths that the gait assumes: nominal, as in the datasheet for all legs, or own, each
    leg's; null is the robot's default, nominal."""


class RobotFiles(BaseModel):
    """A custom robot: the text of its two files, like those in sim/robot/szabadka2."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    toml: str = Field(
        max_length=LONGEST_TOML,
        description=f"robot.toml: legs (at most {MOST_LEGS}), actuators, contact, supply;"
        f" at most {MOST_VALUES} values, nested at most {DEEPEST} deep.",
    )
    urdf: str = Field(
        max_length=LONGEST_URDF,
        description=f"robot.urdf: kinematic tree and inertias; at most {MOST_LINKS} links and as"
        f" many joints, at most {MOST_ELEMENTS} elements, no document type.",
    )

    @model_validator(mode="after")
    def _is_a_robot(self) -> RobotFiles:
        checks = checks_of(digest_of(self.toml, self.urdf))
        # Listing jobs validates their robots every time.
        if not checks:
            _load_files(self)
            checks.add("read")
        return self


_VARIANT: Final = "<variant>"
_FILES: Final = "<files>"


def _variant_or_files(robot: Any) -> str:
    if isinstance(robot, BaseModel):
        return _FILES if isinstance(robot, RobotFiles) else _VARIANT
    return _VARIANT if RobotFiles.model_fields.keys().isdisjoint(robot) else _FILES


RobotSource = Annotated[
    Annotated[RobotName, Tag(NAME)]
    | Annotated[RobotVariant, Tag(_VARIANT)]
    | Annotated[RobotFiles, Tag(_FILES)],
    alternatives(
        "must be a robot's name, or an object: a variant of a robot, or the text of your files",
        among_own=_variant_or_files,
    ),
]
"""A robot in jobs and requests."""

RobotChoice: TypeAlias = "str | RobotVariant | RobotFiles | Robot"
"""A robot as an argument of the simulator."""


def load_robot(robot: RobotChoice) -> Robot:
    """Load a robot by its name, variant or files.

    Args:
        robot: A shipped robot's name, a variant of one, robot files, or a robot, which is returned
            unchanged.

    Raises:
        SimulationInputError: The robot is unknown, or its files cannot be used.
    """
    if isinstance(robot, str):
        return shipped_robot(robot)
    if isinstance(robot, RobotFiles):
        return _load_files(robot)
    return _load_variant(robot) if isinstance(robot, RobotVariant) else robot


@lru_cache(maxsize=32)
def _load_files(files: RobotFiles) -> Robot:
    from gaitswarm.sim.robot.robot import parse_robot

    return parse_robot(files.toml, files.urdf)


@lru_cache(maxsize=32)
def _load_variant(variant: RobotVariant) -> Robot:
    robot = shipped_robot(variant.name)
    chosen = variant.model_dump(include={"contact_law", "planned_soles"}, exclude_none=True)
    description = robot.description.model_copy(update=chosen)
    if any(variant.backlash):
        actuators: dict[str, AnyActuator] = {}
        legs: list[Leg] = []
        for leg in description.legs:
            names = []
            for name, degrees in zip(leg.actuators, variant.backlash, strict=True):
                named = f"{name}, {degrees:g} deg of play"
                play = {"backlash": math.radians(degrees)}
                actuators[named] = description.actuators[name].model_copy(update=play)
                names.append(named)
            legs.append(leg.model_copy(update={"actuators": tuple(names)}))
        description = description.model_copy(update={"actuators": actuators, "legs": tuple(legs)})
    return replace(robot, description=description)
