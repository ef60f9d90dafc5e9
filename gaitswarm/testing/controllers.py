"""Contract tests of controllers."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from unittest import TestCase

import numpy as np

from gaitswarm.sim.catalogue import check_design
from gaitswarm.sim.controllers import CONTROLLERS, ControlLaw, Controller, LookupTable, names_of
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.gait_variables import GAIT_CATALOGUE
from gaitswarm.sim.kernel.walk import check_gains
from gaitswarm.sim.robot import RobotSource, load_robot
from gaitswarm.sim.robot.variant import DEFAULT_ROBOT
from gaitswarm.sim.scenario import find_scenario
from gaitswarm.sim.simulate import simulate

refused = TestCase().assertRaisesRegex


class ControllerContract:
    """Tests of a registered controller.

    Attributes:
        name: Of the controller.
        design: A design that succeeds; the middle of the bounds for missing variables.
        scenario: The scenario.
        robot: The robot.
    """

    name: str
    design: Mapping[str, float] = MappingProxyType({})
    scenario: str = "normal-fast"
    robot: RobotSource = DEFAULT_ROBOT

    @property
    def controller(self) -> Controller:
        """The registered controller."""
        return CONTROLLERS[self.name]

    @property
    def walking_design(self) -> dict[str, float]:
        """Value of every variable."""
        middle = {
            v.name: float(round((v.low + v.high) / 2))
            if v.kind != "continuous"
            else (v.low + v.high) / 2
            for v in self.controller.variables
        }
        return middle | dict(self.design)

    def test_names_are_its_own(self) -> None:
        names = [v.name for v in (*self.controller.variables, *self.controller.conventions)]
        assert len(names) == len(set(names))
        assert not set(GAIT_CATALOGUE) & set(names)
        assert self.controller.name == self.name and self.controller.description

    def test_conventions_have_defaults(self) -> None:
        assert all(v.default is not None for v in self.controller.conventions)

    def test_every_corner_of_the_box_is_a_control_law(self) -> None:
        variables = self.controller.variables
        for side in ("low", "high"):
            for one in variables:
                design = {v.name: getattr(v, side) for v in variables}
                other = one.high if side == "low" else one.low
                self._check(self.controller.compile(design | {one.name: other}))

    def test_the_same_design_is_the_same_law(self) -> None:
        first, second = (self.controller.compile(self.walking_design) for _ in range(2))
        assert _content(first) == _content(second)

    def test_a_missing_variable_is_refused_by_name(self) -> None:
        for variable in self.controller.variables:
            design = {n: v for n, v in self.walking_design.items() if n != variable.name}
            refused(SimulationInputError, variable.name, self.controller.compile, design)

    def test_published_designs_are_complete(self) -> None:
        known = names_of(self.controller) | set(GAIT_CATALOGUE)
        for design in self.controller.published.values():
            assert set(design) <= known
            check_design(self.name, design)

    def test_inferences_are_those_of_tables(self) -> None:
        for inference in self.controller.inferences(self.walking_design):
            assert isinstance(inference.table, LookupTable)
            assert set(inference.axes) == set(inference.inputs)

    def test_it_walks_to_the_same_bits_alone_and_in_company(self) -> None:
        design = self.walking_design
        designs = np.array([list(design.values())] * 2)
        arguments = (find_scenario(self.scenario), self.name, tuple(design))
        both = simulate(*arguments, designs, robot=self.robot).outcome
        alone = simulate(*arguments, designs[:1], robot=self.robot).outcome
        assert both.objectives[:1].tobytes() == alone.objectives.tobytes()
        assert both.objectives[1:].tobytes() == alone.objectives.tobytes()

    def _check(self, law: ControlLaw) -> None:
        assert isinstance(law, ControlLaw)
        gains = (law.proportional_gain, law.integral_gain, law.derivative_gain)
        assert all(isinstance(gain, int) for gain in gains)
        check_gains(law, torque=load_robot(self.robot).is_torque_controlled)


def _content(law: ControlLaw) -> list[object]:
    """The integers and tables of a control law."""
    found: list[object] = [law.proportional_gain, law.integral_gain, law.derivative_gain]
    for table in (law.direct, law.integrated):
        if isinstance(table, LookupTable):
            scales = (table.output_gain, table.error_gain, table.current_gain, table.velocity_gain)
            found += [table.values.shape, table.values.tobytes(), scales]
    return found
