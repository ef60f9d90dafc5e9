"""Reference of a job's best design: a published design, or the start design"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.preference import PREFERENCES
from gaitswarm.services.optimizer.views import Finite, View
from gaitswarm.sim.controllers import CONTROLLERS
from gaitswarm.sim.gait_variables import GAIT_CATALOGUE
from gaitswarm.sim.robot.variant import RobotFiles

ReferenceKind = Literal["published", "start", "job", "design"]

START: Final = "start design"
"""Name of the middle of a job's bounds."""

GIVEN: Final = "given design"


@dataclass(frozen=True, slots=True)
class Reference:
    """A design that others are compared with, evaluated in the cases of a job."""

    # study or preference for which it was published, `START`, a job's id, or `GIVEN`; None if there
    # is none
    name: str | None
    fitness: float | None  # by the job's measure, in double precision; None if it fails in a case
    kind: ReferenceKind = "published"
    results: bytes = b""  # (K, m) raw objectives, NaN where it fails, as little-endian float64

    def objectives(self, cases: int) -> NDArray[np.float64]:
        """Return the (K, m) raw objectives, columns as in the objectives of the job."""
        return np.frombuffer(self.results, "<f8").reshape(cases, -1)

    @property
    def title(self) -> str:
        """The design in a sentence."""
        before = {"published": "published", "job": "the best design of job"}.get(self.kind, "the")
        return f"{before} {self.name}"

    def gain(self, fitness: float | None) -> float | None:
        """Return the relative improvement of a fitness over the reference."""
        if fitness is None or self.fitness is None or not self.fitness > 0.0:
            return None
        return 1.0 - fitness / self.fitness


class ReferenceView(View):
    """The design that a job's best is compared with."""

    name: str = Field(
        description="Study or preference for which it was published, `start design`, the id of a"
        " job, or `given design`.",
        examples=["A"],
    )
    kind: ReferenceKind = Field(
        default="published",
        description="`published`, or without one `start`: the middle of the job's bounds; on"
        " request `job`, the best design of another one, or `design`.",
    )
    fitness: Finite = Field(
        description="By the job's measure, in double precision [1]; null if it fails.",
        examples=[20.72],
    )

    @classmethod
    def from_reference(cls, reference: Reference | None) -> ReferenceView | None:
        if reference is None or reference.name is None:
            return None
        return cls.model_validate(reference)


def reference_design(spec: JobSpec) -> tuple[str, ReferenceKind, Mapping[str, float]] | None:
    """Return the design that a job's best is compared with; None with a plug-in's case."""
    if spec.case is not None:
        return None
    study = None if isinstance(spec.robot, RobotFiles) else published_study(spec)
    if study is None:
        space = spec.design_space()
        (values,) = space.simulated_values(space.middle)
        return START, "start", values
    published = CONTROLLERS[spec.controller].published[study]
    return study, "published", adapted_to_job(published, spec)


def published_study(spec: JobSpec) -> str | None:
    """Return the name of the published design that was tuned by the job's preference."""
    published, preference = CONTROLLERS[spec.controller].published, spec.resolved_preference()
    names = (name for name, other in PREFERENCES.items() if other == preference)
    return next((name for name in (*names, *published) if name in published), None)


def adapted_to_job(published: Mapping[str, float], spec: JobSpec) -> dict[str, float]:
    space = spec.design_space()
    searched = {variable.name for variable in space.variables}
    conventions = {variable.name for variable in CONTROLLERS[spec.controller].conventions}
    fixed = dict(space.fixed)
    held = {name: fixed[name] for name in fixed if name in conventions or name in GAIT_CATALOGUE}
    shared = (name for name in published if name not in GAIT_CATALOGUE or name in searched)
    return {name: published[name] for name in shared} | held


def nearest_design(spec: JobSpec, design: Mapping[str, float]) -> dict[str, float | str] | None:
    """Return the design nearest to a reference, with the first scenario's gait, or None."""
    gait, nearest = spec.resolved_scenarios()[0].model_dump(), dict[str, float | str]()
    for variable in spec.design_space().variables:
        value = design.get(variable.name, gait.get(variable.name))
        if value is None:
            return None
        number = min(max(variable.number(value), variable.low), variable.high)
        nearest[variable.name] = variable.shown(number)
    return nearest
