"""Building blocks of plug-ins: controllers, cases and search methods (docs/plugins.md)."""

from __future__ import annotations

from gaitswarm.services.optimizer.search.optimizer import (
    Optimizer,
    Proposals,
    SearchSettings,
    Start,
)
from gaitswarm.services.optimizer.search.pso import ParticleSwarm, SwarmSettings
from gaitswarm.services.optimizer.search.random_stream import RandomNumbers
from gaitswarm.services.optimizer.search.registry import Method, create_search, from_generator
from gaitswarm.services.optimizer.search.space import Axis, Space
from gaitswarm.sim.case import Case, LongCase, Walk
from gaitswarm.sim.case_registry import CaseFamily, CaseSettings
from gaitswarm.sim.controllers.base import ControlLaw, Controller, Inference, LookupTable, Response
from gaitswarm.sim.controllers.fixed_point import (
    CONTROL_PERIOD,
    FRACTION_BITS,
    INTEGRATOR_UNIT,
    integral_gain,
    required,
    to_fixed,
)
from gaitswarm.sim.controllers.fuzzy_pi import FuzzyPi
from gaitswarm.sim.controllers.quantisation import Axis as TableAxis
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.kernel.walk import Kernel
from gaitswarm.sim.noise import LinkNoise
from gaitswarm.sim.outcome import OBJECTIVES, Objective, Outcome, Status
from gaitswarm.sim.robot import load_robot
from gaitswarm.sim.robot.identifiable import with_parameters
from gaitswarm.sim.robot.robot import Robot, with_shafts
from gaitswarm.sim.scenario import Scenario
from gaitswarm.sim.simulate import simulate as simulate_walk
from gaitswarm.sim.variables import Variable

__all__ = [
    "CONTROL_PERIOD", "FRACTION_BITS", "INTEGRATOR_UNIT", "OBJECTIVES", "Axis", "Case",
    "CaseFamily", "CaseSettings", "ControlLaw", "Controller", "FuzzyPi", "Inference", "Kernel",
    "LinkNoise", "LongCase", "LookupTable", "Method", "Objective", "Optimizer", "Outcome",
    "ParticleSwarm", "Proposals", "RandomNumbers", "Response", "Robot", "Scenario",
    "SearchSettings", "SimulationInputError", "Space", "Start", "Status", "SwarmSettings",
    "TableAxis", "Variable", "Walk", "create_search", "from_generator", "integral_gain",
    "load_robot", "required", "simulate_walk", "to_fixed", "with_parameters", "with_shafts",
]  # fmt: skip
