"""Every built-in controller satisfies the contract of plug-ins' controllers."""

from __future__ import annotations

import pytest

from gaitswarm.sim.controllers import CONTROLLERS
from gaitswarm.testing import ControllerContract
from tests.examples.walks import servo_quadruped_files, torque_quadruped_files


class TestBuiltIn(ControllerContract):
    @pytest.fixture(autouse=True, params=list(CONTROLLERS.built_in))
    def registered(self, request: pytest.FixtureRequest) -> None:
        self.name = request.param
        if self.name == "joint-pd":
            self.robot = torque_quadruped_files()
        if self.name == "servo":
            self.robot = servo_quadruped_files()
