"""Common part of jobs whose designs are simulated in scenarios and judged by a preference"""

from __future__ import annotations

from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import model_validator

from gaitswarm.services.optimizer.jobs.judgement import Judgement
from gaitswarm.services.optimizer.jobs.preference import (
    PREFERENCES,
    Preference,
    PreferenceChoice,
    figure_of_merit,
    judge,
)
from gaitswarm.services.optimizer.jobs.spec import Spec, requested
from gaitswarm.sim.controllers import ControlLaw
from gaitswarm.sim.outcome import OBJECTIVES, Objective
from gaitswarm.sim.scenario import Scenario, ScenarioChoice, find_scenario
from gaitswarm.sim.simulate import check_drives

Floats = NDArray[np.float64]


class WalksSpec(Spec):
    """A job with scenarios and a preference; each kind declares these fields with its defaults."""

    if TYPE_CHECKING:
        scenarios: tuple[ScenarioChoice, ...]
        preference: PreferenceChoice

    @model_validator(mode="after")
    def _scenarios_differ(self) -> Self:
        names = [scenario.name for scenario in self.resolved_scenarios()]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"scenarios: {name!r} is named twice")
        return self

    def resolved_scenarios(self) -> tuple[Scenario, ...]:
        """Return the scenarios with presets resolved."""
        return tuple(
            find_scenario(entry) if isinstance(entry, str) else entry for entry in self.scenarios
        )

    def resolved_preference(self) -> Preference:
        """Return the preference with a preset resolved."""
        return PREFERENCES[self.preference] if isinstance(self.preference, str) else self.preference

    def check_drives(self, law: ControlLaw) -> None:
        """Check that the controller can drive the robot's actuators.

        Args:
            law: Of any design of the controller.

        Raises:
            InvalidRequest: It cannot; the field is `controller`.
        """
        with requested("controller"):
            check_drives(law, self.robot)

    @property
    def objectives(self) -> tuple[Objective, ...]:
        """Raw objectives of a walk: f1..f6 of table 4.1."""
        return OBJECTIVES

    @property
    def case_names(self) -> tuple[str, ...]:
        """Names of the scenarios, in order."""
        return tuple(scenario.name for scenario in self.resolved_scenarios())

    def judge(self, objectives: Floats, failed: NDArray[np.bool_]) -> Judgement:
        """Judge designs by the preference (eq. 3.8, 4.1, 4.2)."""
        return judge(objectives, failed, self.resolved_preference())

    def figure_of_merit(self, fitness: float) -> float | None:
        """Return F of eq. 3.1, maximized; None unless the preference is that of chapter 3."""
        return figure_of_merit(fitness, self.resolved_preference())
