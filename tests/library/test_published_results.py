"""The default model against what the thesis printed (tables 3.6, 4.6 and 5.1).

What a row misses by is in docs/model.md; here are the bounds that the default has to keep.
"""

from __future__ import annotations

import numpy as np
import pytest

import gaitswarm
from gaitswarm.services.optimizer.jobs.preference import PREFERENCES, judge
from gaitswarm.sim.controllers import ControllerName
from gaitswarm.sim.drives import compare, find_drive
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.scenario import find_scenario

pytestmark = pytest.mark.slow

PRINTED: dict[str, tuple[ControllerName, tuple[float, ...], float]] = {
    "fuzzy-pso-ps": ("fuzzy-pi-3", (8.71, 1.77, 16.09, 41.96), 0.156),
    "pi-pso-ps": ("pi", (8.82, 1.77, 16.39, 42.55), 0.152),
}
"""Table 3.6: controller; torque [N m], accelerations [m/s2, rad/s2], energy [J/m]; speed [m/s]."""

RANDOM_DESIGNS = 240


def published(controller: ControllerName, name: str) -> dict[str, float]:
    return dict(gaitswarm.CONTROLLERS[controller].published[name])


@pytest.mark.parametrize(("name", "within"), [("fuzzy-pso-ps", 0.2), ("pi-pso-ps", 0.4)])
def test_chapter_3s_given_optima_walk_as_printed(name: str, within: float) -> None:
    controller, objectives, speed = PRINTED[name]
    design = published(controller, name)
    walked = gaitswarm.simulate(design, controller=controller, scenarios="straight")
    assert walked.objectives[0, 0, :4] == pytest.approx(objectives, rel=within)
    assert 1.0 / walked.objectives[0, 0, 4] == pytest.approx(speed, rel=0.05)


def test_optimum_a_is_worth_what_was_printed_and_c_about_that() -> None:
    a = gaitswarm.simulate(published("fuzzy-pi", "A"), preference="A").fitness[0]
    c = gaitswarm.simulate(published("fuzzy-pi", "C"), preference="C").fitness[0]
    assert a == pytest.approx(20.8696, rel=0.1)
    assert 0.5 < c / 1_396_908 < 2.0


@pytest.mark.thorough(
    "simulates 240 designs in addition to that of",
    "test_optimum_a_is_worth_what_was_printed_and_c_about_that",
)
def test_optima_a_and_b_are_among_the_best_twentieth_of_random_designs() -> None:
    variables = gaitswarm.CONTROLLERS["fuzzy-pi"].variables
    generator = np.random.Generator(np.random.Philox(key=[1, 0]))
    designs = {
        v.name: np.append(
            generator.integers(int(v.low), int(v.high), RANDOM_DESIGNS, endpoint=True)
            if v.kind == "integer"
            else generator.uniform(v.low, v.high, RANDOM_DESIGNS),
            [published("fuzzy-pi", preference)[v.name] for preference in ("A", "B")],
        )
        for v in variables
    }
    walked = gaitswarm.simulate(designs)
    failed = walked.statuses != Status.OK
    for preference, row in ((PREFERENCES["A"], -2), (PREFERENCES["B"], -1)):
        fitness = judge(walked.objectives, failed, preference).fitness
        better = int((fitness[:RANDOM_DESIGNS] < fitness[row]).sum())
        assert better / RANDOM_DESIGNS <= 0.05, preference


def test_the_driving_of_2016_beats_that_of_2011_as_on_the_robot() -> None:
    old, new = compare([find_drive("2011"), find_drive("2016")], [find_scenario("normal-fast")])
    assert old.status is new.status is Status.OK
    assert old.speed is not None and new.speed is not None
    assert old.power is not None and new.power is not None
    assert old.effectivity is not None and new.effectivity is not None
    assert new.speed > old.speed
    assert new.power < old.power
    assert new.effectivity > old.effectivity
    assert old.speed == pytest.approx(0.0621, rel=0.3)
    assert new.speed == pytest.approx(0.0787, rel=0.3)
