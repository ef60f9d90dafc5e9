"""Cases whose walks share calls of a kernel."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from numpy.typing import NDArray

from gaitswarm.sim.calibration import CalibrationWalk
from gaitswarm.sim.case import Case, MeasuredWalk, Walk, run_together
from gaitswarm.sim.kernel import Precision
from gaitswarm.sim.kernel.native import NativeKernel
from gaitswarm.sim.kernel.walk import Coding, Walking, WalkResult, WalkSetup, walk_together
from gaitswarm.sim.outcome import Objective, Outcome
from gaitswarm.sim.robot import RobotSource
from gaitswarm.sim.scenario import Scenario
from tests.examples.walks import SHORT_WALK, UPHILL_WALK

SHORT, UPHILL = (Scenario.model_validate(walk) for walk in (SHORT_WALK, UPHILL_WALK))
GAINS = np.array([[0.3, 0.1], [0.2, 0.3], [0.5, 0.0], [0.1, 0.4], [0.4, 0.2]])
MASSES = np.array([[3.0], [4.5], [2.5]])
DRIVE = (("I", 0.1), ("P", 0.3))

CASES: tuple[Case, ...] = (
    Walk("szabadka2", "pi", SHORT, ("P", "I")),
    MeasuredWalk("szabadka2", "pi", UPHILL, ("P", "I")),
    CalibrationWalk("w", ("szabadka2",), "pi", DRIVE, UPHILL, ("body_mass",)),
)
DESIGNS = (GAINS, GAINS[1:], MASSES)


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Number of walks of every call of a kernel."""
    seen: list[int] = []
    walk = NativeKernel.walk

    def counted(
        kernel: NativeKernel, setups: Sequence[WalkSetup], coding: Coding, *, log: bool
    ) -> Sequence[WalkResult]:
        seen.append(len(setups))
        return walk(kernel, setups, coding, log=log)

    monkeypatch.setattr(NativeKernel, "walk", counted)
    return seen


def bits(outcome: Outcome) -> tuple[bytes, bytes]:
    return outcome.objectives.tobytes(), outcome.statuses.tobytes()


def test_walks_of_one_kernel_share_a_call_and_have_the_bits_that_each_case_gives_them(
    calls: list[int],
) -> None:
    together = run_together(CASES, DESIGNS)
    assert calls == [5 + 4 + 3]
    alone = [case.run(designs) for case, designs in zip(CASES, DESIGNS, strict=True)]
    assert [bits(outcome) for outcome in together] == [bits(outcome) for outcome in alone]


def test_walks_of_other_kernels_have_calls_of_their_own(calls: list[int]) -> None:
    laws = CalibrationWalk("laws", ("szabadka2",), "pi", DRIVE, SHORT, ("contact_law",))
    (outcome,) = run_together([laws], [np.array([[0.0], [1.0], [0.0]])])
    assert calls == [2, 1]
    assert bits(outcome) == bits(laws.run(np.array([[0.0], [1.0], [0.0]])))


def test_all_tasks_of_a_scenario_share_one_plan_that_is_read_only(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    seen: list[WalkSetup] = []
    walk = NativeKernel.walk

    def noted(
        kernel: NativeKernel, setups: Sequence[WalkSetup], coding: Coding, *, log: bool
    ) -> Sequence[WalkResult]:
        seen.extend(setups)
        return walk(kernel, setups, coding, log=log)

    monkeypatch.setattr(NativeKernel, "walk", noted)
    for designs in (GAINS[:1], GAINS[1:2]):
        CASES[0].run(designs)
    first, second = seen
    assert first.control_law is not second.control_law
    for name in ("start", "internal_state", "parameters", "desired"):
        array = getattr(first, name)
        assert array is getattr(second, name) and not array.flags.writeable


class NoWalk:
    """A case that has no walks to share."""

    name = "n"
    duration = 1.0
    robots: tuple[RobotSource, ...] = ("szabadka2",)
    precision: Precision = "double"
    objectives: tuple[Objective, ...] = ()

    def run(self, designs: NDArray[np.float64]) -> Outcome:
        return Outcome(designs[:, :1], np.zeros(len(designs), dtype=np.uint8))


def test_a_case_without_walks_runs_together_with_others() -> None:
    first, second = run_together([NoWalk(), CASES[0]], [GAINS, GAINS])
    assert bits(first) == bits(NoWalk().run(GAINS))
    assert bits(second) == bits(CASES[0].run(GAINS))


def test_computations_of_several_rounds_share_each_round(calls: list[int]) -> None:
    case = CASES[0]
    assert isinstance(case, Walk)
    wanted = next(case.walking(GAINS))

    def rounds(count: int) -> Walking[list[float]]:
        found: list[float] = []
        for index in range(count):
            (result,) = yield [wanted[index]]
            found.append(float(result.sums[0]))
        return found

    results = walk_together([rounds(2), rounds(3), rounds(0)])
    assert calls == [2, 2, 1]
    assert results == (results[1][:2], results[1], [])
    assert len(set(results[1])) == 3
