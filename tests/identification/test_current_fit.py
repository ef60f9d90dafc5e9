"""The error that a fit minimizes, and walks as they are recorded."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError

from gaitswarm.sim.assembly import control_steps, kernel_of, plan_walk
from gaitswarm.sim.controllers import CONTROLLERS
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.identification import CurrentFit, RecordedWalk, recorded_currents
from gaitswarm.sim.measurement.measured_log import simulated_log
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.robot import RobotVariant, load_robot
from gaitswarm.sim.robot.identifiable import with_parameters
from tests.examples.walks import PUBLISHED_A, logged_walk
from tests.identification.conftest import SCENARIO, TRUTH, Twin
from tests.sim.test_identifiable import described_values

pytestmark = pytest.mark.slow


@pytest.mark.variants(without="backlash")
@pytest.mark.parametrize(
    "source",
    [
        "szabadka2",
        RobotVariant(name="szabadka2", backlash=(2.5, 1.0, 1.0)),
        "szabadka2-reconstructed",
    ],
    ids=["rigid", "backlash", "low-pass"],
)
def test_currents_are_those_of_the_log(source: str | RobotVariant) -> None:
    robot = load_robot(source)
    kernel, (coding, timestep) = kernel_of(robot), control_steps(robot)
    plan = plan_walk(robot, SCENARIO, timestep)
    assert plan is not None
    setup = plan(CONTROLLERS["fuzzy-pi"].compile(PUBLISHED_A))
    (result,) = kernel.walk([setup], coding, log=True)
    log = simulated_log(robot, logged_walk(SCENARIO, robot=robot))
    assert result.states is not None
    np.testing.assert_allclose(recorded_currents(robot, result.states), log.current, atol=1e-10)


def test_true_parameters_leave_only_the_instruments_errors(twin: Twin) -> None:
    fit = CurrentFit("a walk", "szabadka2", twin.recording, tuple(TRUTH))
    nominal = described_values(twin.robot) | {"body_mass": 3.2}
    designs = np.array([list(TRUTH.values()), [nominal[name] for name in TRUTH]])
    outcome = fit.run(designs)
    assert outcome.statuses.tolist() == [Status.OK, Status.OK]
    # Noise of 0.02 A has a mean size of 0.016 A; absolute values near zero take some of it away.
    assert (outcome.objectives[0] < 0.017).all()
    assert outcome.objectives[1].mean() > 1.5 * outcome.objectives[0].mean()


def test_a_fit_in_single_precision_is_nearly_that_in_double(twin: Twin) -> None:
    fit = CurrentFit("a walk", "szabadka2", twin.recording, ("body_mass",))
    single = replace(fit, precision="single").run(np.array([[3.2]])).objectives
    double = fit.run(np.array([[3.2]])).objectives
    assert not np.array_equal(single, double)
    np.testing.assert_allclose(single, double, rtol=1e-2)


def test_every_link_has_its_own_error(twin: Twin) -> None:
    fit = CurrentFit("a walk", "szabadka2", twin.recording, ("efficiency_left_front_coxa",))
    worse, described = fit.run(np.array([[0.98], [0.6]])).objectives
    assert worse[0] != pytest.approx(described[0], rel=0.01)
    assert worse[2] == pytest.approx(described[2], rel=0.2)


def test_desired_angles_are_those_of_the_described_robot(twin: Twin) -> None:
    long_soles = {f"sole_{leg.name}": 0.016 for leg in twin.robot.legs}
    changed = with_parameters(twin.robot, {**long_soles, "planned_soles": "own"})
    own = logged_walk(SCENARIO, robot=changed)
    planned = logged_walk(SCENARIO, robot=changed, planner=twin.robot)
    described = logged_walk(SCENARIO, robot=twin.robot)
    np.testing.assert_array_equal(planned.desired_angle, described.desired_angle)
    assert not np.array_equal(own.desired_angle, described.desired_angle)


def test_a_recording_begins_where_the_logs_whole_cycles_do(twin: Twin) -> None:
    # The log starts 0.124 s before the walk; its last two whole cycles are all of the walk.
    assert twin.recording.first_tick == 0
    assert len(twin.recording.current) == 1000
    assert twin.recording.synthetic


def test_a_design_that_does_not_walk_to_the_end_has_failed(twin: Twin) -> None:
    soft = tuple(f"stiffness_{leg.name}" for leg in twin.robot.legs)
    fit = CurrentFit("a walk", "szabadka2", twin.recording, soft)
    outcome = fit.run(np.array([[1.0] * 6, [10_000.0] * 6]))
    assert outcome.statuses.tolist() == [Status.FELL, Status.OK]
    assert np.isnan(outcome.objectives[0]).all()


def test_a_recording_of_other_joints_is_refused(twin: Twin) -> None:
    other = twin.recording.model_copy(update={"joints": twin.recording.joints[::-1]})
    with pytest.raises(SimulationInputError, match="a walk: recorded with other joints"):
        CurrentFit("a walk", "szabadka2", other, ("body_mass",)).run(np.array([[4.0]]))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"current": [[0.1] * 17]}, "current.0: 17 numbers for 18 joints"),
        ({"current": [[-0.1] * 18]}, "greater than or equal to 0"),
        ({"design": {"I": 0.1}}, "design: .*FI1R.* missing"),
        ({"first_tick": 10}, "after the end of the walk at 2 s"),
    ],
)
def test_an_inconsistent_recording_is_refused(
    twin: Twin, change: dict[str, object], message: str
) -> None:
    with pytest.raises(ValidationError, match=message):
        RecordedWalk.model_validate(twin.recording.model_dump() | change)
