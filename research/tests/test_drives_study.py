"""The drives of 2011 and 2016, compared."""

from __future__ import annotations

import pytest

from gaitswarm import SCENARIOS
from gaitswarm_research.studies.drives import driven_as_in_2011, figures
from research.tests.conftest import Command

pytestmark = pytest.mark.slow

DEFAULT_ROBOT = "szabadka2-reconstructed"


def test_the_driving_of_2016_beats_that_of_2011_as_on_the_robot() -> None:
    old, new = (figures(drive, SCENARIOS[0], DEFAULT_ROBOT) for drive in ("2011", "2016"))
    assert old["status"] == new["status"] == "ok"
    assert new["speed"] > old["speed"]
    assert new["power"] < old["power"]
    assert new["effectivity"] > old["effectivity"]
    assert old["speed"] == pytest.approx(0.0621, rel=0.3)
    assert new["speed"] == pytest.approx(0.0787, rel=0.3)


def test_any_scenario_may_be_driven_as_in_2011_in_its_own_cycle() -> None:
    slow = driven_as_in_2011(SCENARIOS[3])
    assert (slow.cycle_time, slow.trajectory_rate) == (2.2, 42 / 2.2)
    kept = ("name", "radius", "hip_height", "load", "stride", "height", "cycles")
    assert [getattr(slow, name) for name in kept] == [getattr(SCENARIOS[3], name) for name in kept]


def test_every_drive_walks_in_every_scenario(research: Command) -> None:
    done = research("study", "drives", "--json")
    assert done.code == 0, done.err
    assert len(done.json) == 2 * len(SCENARIOS)
