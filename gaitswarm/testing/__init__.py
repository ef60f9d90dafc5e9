"""Contract suites that a plug-in's own tests subclass.

They are plain classes of `test_` methods, for pytest or any runner that knows those; nothing of a
test runner is imported. What is tested is looked up by its name, so that its entry point is, too.
"""

from gaitswarm.testing.cases import CaseContract
from gaitswarm.testing.controllers import ControllerContract
from gaitswarm.testing.optimizers import OptimizerContract

__all__ = ["CaseContract", "ControllerContract", "OptimizerContract"]
