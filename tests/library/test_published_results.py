"""The default model against what the thesis printed (tables 3.6 and 4.6).

What a row misses by is in docs/model.md; here are the bounds that the default has to keep.
"""

from __future__ import annotations

import numpy as np
import pytest

import gaitswarm
from gaitswarm.services.optimizer.jobs.preference import PREFERENCES, judge
from gaitswarm.sim.controllers import ControllerName
from gaitswarm.sim.outcome import Status

pytestmark = pytest.mark.slow

PRINTED: dict[str, tuple[ControllerName, tuple[float, ...], float]] = {
    "fuzzy-pso-ps": ("fuzzy-pi-3", (8.71, 1.77, 16.09, 41.96), 0.156),
    "pi-pso-ps": ("pi", (8.82, 1.77, 16.39, 42.55), 0.152),
}
"""Table 3.6: controller; torque [N m], accelerations [m/s2, rad/s2], energy [J/m]; speed [m/s]."""

RANDOM_DESIGNS = 240


def published(controller: ControllerName, name: str) -> dict[str, float]:
    return dict(gaitswarm.CONTROLLERS[controller].published[name])


@pytest.mark.parametrize(("name", "within"), [("fuzzy-pso-ps", 0.2), ("pi-pso-ps", 0.5)])
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
