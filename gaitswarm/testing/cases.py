"""Contract tests of cases."""

from __future__ import annotations

import math
import pickle
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar
from unittest import TestCase

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.case import Case, LongCase, Walk, run_together
from gaitswarm.sim.case_registry import CASES, CaseSettings, create_case
from gaitswarm.sim.controllers import CONTROLLERS
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.gait_variables import with_gait
from gaitswarm.sim.outcome import Outcome, Status
from gaitswarm.sim.robot import DEFAULT_ROBOT
from gaitswarm.sim.scenario import find_scenario

refused = TestCase().assertRaisesRegex


class CaseContract:
    """Tests of a registered case. They evaluate two designs several times.

    Attributes:
        name: Of the case.
        settings: Settings other than the defaults, fast ones.
        scenario: The scenario, of which one cycle is simulated.
        controller: Of the walk.
        designs: Values of the controller's variables, by name, of designs that succeed.
    """

    name: str
    settings: Mapping[str, Any] = MappingProxyType({})
    scenario: str = "normal-fast"
    controller: str = "p"
    designs: tuple[Mapping[str, float], ...] = (
        MappingProxyType({"P": 0.25}),
        MappingProxyType({"P": 0.5}),
    )
    evaluated: ClassVar[Outcome]

    @property
    def read_settings(self) -> CaseSettings:
        """Return the settings as in a job."""
        return CASES[self.name].settings.model_validate({"name": self.name, **self.settings})

    @property
    def walk(self) -> Walk:
        """The walk that the case replaces."""
        names = tuple(variable.name for variable in CONTROLLERS[self.controller].variables)
        scenario = find_scenario(self.scenario).model_copy(update={"cycles": 1.0})
        return Walk(DEFAULT_ROBOT, self.controller, scenario, names)

    @property
    def case(self) -> Case:
        """The case."""
        return create_case(self.read_settings, self.walk)

    @property
    def rows(self) -> NDArray[np.float64]:
        """The designs as an array."""
        return np.array([[design[n] for n in self.walk.variables] for design in self.designs])

    def test_settings_come_back_from_their_document(self) -> None:
        settings = self.read_settings
        assert type(settings).model_validate(settings.model_dump(mode="json")) == settings
        assert settings.name == self.name
        document = {**settings.model_dump(), "no_such_setting": 1}
        refused(ValueError, "no_such_setting", type(settings).model_validate, document)

    def test_it_stands_for_the_walk(self) -> None:
        case, walk = self.case, self.walk
        assert isinstance(case, Case)
        assert (case.name, case.robots, case.objectives) == (
            walk.name,
            walk.robots,
            walk.objectives,
        )
        assert case.duration > 0.0 and math.isfinite(case.duration)

    @property
    def outcome(self) -> Outcome:
        """Outcome of the designs, evaluated once for all tests."""
        contract = type(self)
        if "evaluated" not in vars(contract):
            contract.evaluated = self.checked(self.case.run(self.rows), len(self.rows))
        return contract.evaluated

    def test_outcomes_are_in_the_order_of_designs_and_designs_do_not_meet(self) -> None:
        case, rows, both = self.case, self.rows, self.outcome
        last = self.checked(case.run(rows[-1:]), 1)
        assert both.objectives[-1:].tobytes() == last.objectives.tobytes()
        assert both.statuses[-1:].tobytes() == last.statuses.tobytes()
        turned = self.checked(case.run(rows[::-1]), len(rows))
        assert turned.objectives[::-1].tobytes() == both.objectives.tobytes()

    def test_another_process_gets_the_same_case(self) -> None:
        copy = pickle.loads(pickle.dumps(self.case))  # noqa: S301 - written by the line itself
        assert copy.run(self.rows).objectives.tobytes() == self.outcome.objectives.tobytes()

    def test_no_designs_are_no_outcomes(self) -> None:
        self.checked(self.case.run(self.rows[:0]), 0)

    def test_together_with_other_cases_it_has_the_same_bits(self) -> None:
        case, rows = self.case, self.rows
        together, _ = run_together([case, self.walk], [rows, rows])
        assert together.objectives.tobytes() == self.outcome.objectives.tobytes()

    def test_the_controller_is_what_drives_it(self) -> None:
        objectives = self.outcome.objectives
        assert objectives[0].tobytes() != objectives[-1].tobytes()

    def test_a_design_that_cannot_be_simulated_is_refused(self) -> None:
        wrong = self.rows.copy()
        wrong[0, 0] = math.nan
        refused(SimulationInputError, self.walk.variables[0], self.case.run, wrong)

    def test_a_pose_out_of_reach_is_a_status(self) -> None:
        walk = self.walk
        far = Walk(
            walk.robot, walk.controller, with_gait(walk.scenario, {"stride": 1.0}), walk.variables
        )
        outcome = create_case(self.read_settings, far).run(self.rows)
        assert (outcome.statuses != Status.OK).all()

    def test_a_long_case_can_be_broken_off(self) -> None:
        case = self.case
        if isinstance(case, LongCase):
            try:
                case.run_until(self.rows, lambda: True)
            except Exception:  # noqa: BLE001 - of any kind, says the protocol
                return
            raise AssertionError("run_until ignored should_stop")

    def checked(self, outcome: Outcome, count: int) -> Outcome:
        """Check the shape, statuses and numbers of an outcome."""
        assert outcome.objectives.shape == (count, len(self.case.objectives))
        assert outcome.objectives.dtype == np.float64 and outcome.statuses.dtype == np.uint8
        assert set(outcome.statuses.tolist()) <= set(Status)
        assert np.isfinite(outcome.objectives[outcome.statuses == Status.OK]).all()
        return outcome
