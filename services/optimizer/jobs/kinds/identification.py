"""Identification jobs, which fit a robot's parameters to measured walks (thesis 2.4)"""

from __future__ import annotations

import math
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, Field, model_validator

from gaitswarm.services.optimizer.jobs.design_space import DesignSpace
from gaitswarm.services.optimizer.jobs.preference import Judgement
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.case import Case
from gaitswarm.sim.identification import LINK_CURRENTS, CurrentFit, Recordings
from gaitswarm.sim.input import check_distinct
from gaitswarm.sim.outcome import Objective
from gaitswarm.sim.robot import load_robot
from gaitswarm.sim.robot.identifiable import identifiable_variables, with_parameters

RecordingId = Annotated[
    str,
    Field(
        pattern=r"^[0-9a-f]{32}$",
        description="Id of a recorded walk, as returned by POST /v1/recordings.",
        examples=["0f343b0931126a20f133d67c2b018a3b"],
    ),
]

Link = Literal[1, 2, 3]


class IdentificationSpec(Spec):
    """Fit a robot's parameters to recorded walks.

    Fitness is the mean absolute error of motor currents (eq. 2.21), over links and walks [A].
    """

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "kind": "identification",
                    "recordings": ["0f343b0931126a20f133d67c2b018a3b"],
                    "variables": ["battery_voltage", "body_mass"],
                    "iterations": 100,
                }
            ]
        },
    )

    kind: Literal["identification"] = Field(description="Fit parameters of the robot.")
    recordings: tuple[RecordingId, ...] = Field(
        min_length=1,
        max_length=32,
        description="Recorded walks to fit simultaneously; see /v1/recordings.",
    )
    links: tuple[Link, ...] = Field(
        default=(1, 2, 3),
        min_length=1,
        max_length=3,
        description="Links whose currents are compared: 1 coxa, 2 femur, 3 tibia.",
    )

    @model_validator(mode="after")
    def _can_be_run(self) -> IdentificationSpec:
        check_distinct("recordings", self.recordings)
        check_distinct("links", self.links)
        self.design_space()
        return self

    def design_space(self) -> DesignSpace:
        """Return the chosen robot parameters; the others stay as described."""
        identifiable = identifiable_variables(load_robot(self.robot))
        return DesignSpace.build(
            optional=identifiable, default=identifiable, chosen=self.variables, fixed=self.fixed
        )

    def check_can_be_simulated(self) -> None:
        """Check that the robot is valid at both ends of all bounds."""
        super().check_can_be_simulated()
        robot, space = load_robot(self.robot), self.design_space()
        for values in space.corners():
            with space.requested():
                with_parameters(robot, values)

    @property
    def objectives(self) -> tuple[Objective, ...]:
        """Mean absolute error of the currents of each link [A]."""
        return LINK_CURRENTS

    @property
    def case_names(self) -> tuple[str, ...]:
        """Ids of the recordings, shortened, in order."""
        return tuple(recording[:12] for recording in self.recordings)

    @property
    def recording_ids(self) -> tuple[str, ...]:
        return self.recordings

    def cases(self, recordings: Recordings) -> tuple[Case, ...]:
        """Return one fit for each recorded walk.

        Args:
            recordings: Those named by `recording_ids`, by id.
        """
        names = self.design_space().names
        return tuple(
            CurrentFit(name, self.robot, recordings[recording], names, self.precision)
            for name, recording in zip(self.case_names, self.recordings, strict=True)
        )

    def judge(self, objectives: Floats, failed: NDArray[np.bool_]) -> Judgement:
        """Judge designs by the mean absolute error of currents over walks (eq. 2.21) [A]."""
        columns = [link - 1 for link in self.links]
        means = [
            [math.fsum(walk) / len(columns) for walk in design]
            for design in objectives[:, :, columns].tolist()
        ]
        errors = np.where(failed, np.inf, np.array(means).reshape(failed.shape))
        fitness = [math.fsum(row) / len(row) for row in errors.tolist()]
        with np.errstate(divide="ignore"):
            return Judgement(np.array(fitness), np.log(errors))
