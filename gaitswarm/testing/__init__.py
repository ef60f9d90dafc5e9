"""Contract suites that a plug-in's own tests subclass.

They are plain classes of `test_` methods, for pytest or any compatible runner; no test runner is
imported. The subject is looked up by name, so that its entry point is tested, too.
"""

from gaitswarm.testing.cases import CaseContract
from gaitswarm.testing.controllers import ControllerContract
from gaitswarm.testing.optimizers import OptimizerContract

__all__ = ["CaseContract", "ControllerContract", "OptimizerContract"]
