"""The case keeps to what gaitswarm expects of every case."""

from gaitswarm.testing import CaseContract


class TestMujocoWalk(CaseContract):
    """With steps that are long enough for a test."""

    name = "mujoco-walk"
    settings = {"rate": 1000}  # noqa: RUF012
