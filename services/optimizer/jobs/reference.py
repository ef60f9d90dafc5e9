"""What a job's best is measured against: a published or a start design, judged as its own are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.labels import is_own_robot
from gaitswarm.services.optimizer.jobs.preference import PREFERENCES
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.sim.controllers import CONTROLLERS
from gaitswarm.sim.gait_variables import GAIT_CATALOGUE

ReferenceKind = Literal["published", "start"]

START: Final = "start design"
"""What the middle of a job's bounds is called."""


@dataclass(frozen=True, slots=True)
class Reference:
    """A published design, or the start design, in the cases of a job.

    Attributes:
        name: Of the study or preference that it was published for, or `START`; None where there is
            none for the job.
        fitness: What it comes to, judged as the job judges, in double precision; None where it
            does not walk in every case.
        kind: Whether it was published or is the middle of the job's bounds.
    """

    name: str | None
    fitness: float | None
    kind: ReferenceKind = "published"

    def gain(self, fitness: float | None) -> float | None:
        """How much better a design is."""
        if fitness is None or self.fitness is None or not self.fitness > 0.0:
            return None
        return 1.0 - fitness / self.fitness


def published_for(spec: Spec) -> tuple[str, Mapping[str, float]] | None:
    """The published design of a job's controller and preference.

    Published designs are of the robots that ship with gaitswarm. A plug-in's case judges by
    another measure.
    """
    if not isinstance(spec, JobSpec) or spec.case is not None:
        return None
    study = published_study(spec)
    if study is None or is_own_robot(spec.robot):
        return None
    return study, on_the_jobs_terms(CONTROLLERS[spec.controller].published[study], spec)


def start_of(spec: Spec) -> Mapping[str, float] | None:
    """The start design of a job: the middle of the bounds within which it searches.

    Nobody published a design of a user's own robot; this one shows what the search has gained.
    """
    if not isinstance(spec, JobSpec) or spec.case is not None or not is_own_robot(spec.robot):
        return None
    space = spec.design_space()
    middle = space.designs(np.array([(space.low + space.high) / 2.0]))
    (values,) = space.simulated(middle).tolist()
    return dict(zip(space.names, values, strict=True))


def reference_design(spec: Spec) -> tuple[str, ReferenceKind, Mapping[str, float]] | None:
    """The design that a job's best is measured against."""
    published = published_for(spec)
    if published is not None:
        name, design = published
        return name, "published", design
    start = start_of(spec)
    return None if start is None else (START, "start", start)


def published_study(spec: JobSpec) -> str | None:
    """Name the published design of a job's controller that was tuned as the job tunes."""
    published = CONTROLLERS[spec.controller].published
    wanted = spec.resolved_preference()
    names = [name for name, known in PREFERENCES.items() if known == wanted and name in published]
    return next(iter([*names, *published]), None)


def on_the_jobs_terms(published: Mapping[str, float], spec: JobSpec) -> dict[str, float]:
    """A published design for comparison with what a job finds.

    It walks in its own gait only as far as the job searches the gait; else in the gait that all of
    the job's designs have. So with conventions that the job holds fixed.
    """
    space = spec.design_space()
    searched = {variable.name for variable in space.variables}
    conventions = {variable.name for variable in CONTROLLERS[spec.controller].conventions}
    held = {
        name: value for name, value in space.fixed if name in conventions or name in GAIT_CATALOGUE
    }
    own = {
        name: value
        for name, value in published.items()
        if name not in GAIT_CATALOGUE or name in searched
    }
    return own | held
