"""Today's version gives the numbers that are kept in numbers.json; see `python -m tests.golden`.

The compiled kernel gives them to the last bit, on every machine. Without a C compiler the reference
kernel walks, and agrees to 1e-9.
"""

from __future__ import annotations

import json
from typing import Any

import pytest

from gaitswarm import simulate
from gaitswarm.sim.assembly import Backend
from gaitswarm.sim.compiler.compilation import Target, target
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.scenario import SCENARIOS
from gaitswarm.sim.simulate import prepare
from tests.examples.processes import python
from tests.golden.numbers import (
    fitness_of,
    objectives_of_the_optimum,
    objectives_with_torque,
    read,
    run_demo,
    run_gait_demo,
)

GOLDEN = read()

# Emulates a machine with narrower vectors: the kernel is compiled for it, numpy is restricted by
# its environment to leave the wider instructions alone.
NARROW_MACHINE = """
import json, sys
from gaitswarm.sim.compiler import compilation
narrow = compilation.Target(int(sys.argv[1]), sys.argv[2])
compilation.target = lambda: narrow
from gaitswarm.sim.robot import DEFAULT_ROBOT, load_robot
from gaitswarm.sim.assembly import kernel_of
from gaitswarm.sim.scenario import SCENARIOS
from tests.golden.numbers import objectives_of_the_optimum
found = objectives_of_the_optimum(tuple(s for s in SCENARIOS if s.name in sys.argv[3:]))
print(json.dumps([kernel_of(load_robot(DEFAULT_ROBOT)).lanes, found]))
"""

NARROWLY_WALKED = ("slope-fast", "turn-right-fast")
"""Where all six legs differ; a machine without fused multiply-adds takes seconds for each."""

AVX512 = "X86_V4 AVX512F AVX512CD AVX512_SKX AVX512_CLX AVX512_CNL AVX512_ICL AVX512_SPR"
AVX2 = "X86_V3 AVX2 FMA3"


@pytest.fixture(scope="module")
def backend() -> Backend:
    """The compiled kernel, or the reference on a machine without a compiler."""
    try:
        prepare(backend="native")
    except SimulationInputError:
        return "reference"
    return "native"


def as_kept(kept: Any, backend: Backend) -> Any:
    """What a backend must give: the bits, or numbers that are as good as the same."""
    if backend == "native":
        return kept
    if isinstance(kept, dict):
        return {name: as_kept(value, backend) for name, value in kept.items()}
    return pytest.approx(kept, rel=1e-9, abs=1e-12)


def test_the_published_optimum_is_worth_what_it_was(backend: Backend) -> None:
    found = objectives_of_the_optimum(backend=backend)
    assert found == as_kept(GOLDEN.optimum, backend)


@pytest.mark.filterwarnings("ignore:no C compiler found")
def test_torque_controlled_actuators_give_what_they_did(backend: Backend) -> None:
    assert objectives_with_torque(backend=backend) == as_kept(GOLDEN.torque, backend)


@pytest.mark.filterwarnings("ignore:no C compiler found")
def test_the_demos_best_design_is_worth_what_it_was(backend: Backend) -> None:
    assert fitness_of(GOLDEN.best.design) == as_kept(GOLDEN.best.fitness, backend)
    assert GOLDEN.best.fitness == pytest.approx(16.6295712049947)


@pytest.mark.filterwarnings("ignore:no C compiler found")
def test_the_second_demos_best_design_is_worth_what_it_was(backend: Backend) -> None:
    best = GOLDEN.gait_best
    assert simulate(best.design).fitness.item() == as_kept(best.fitness, backend)
    assert best.fitness == pytest.approx(10.36824727)


@pytest.mark.thorough("test_the_second_demos_best_design_is_worth_what_it_was")
@pytest.mark.slow
def test_the_second_demo_finds_its_best_design(backend: Backend) -> None:
    if backend == "reference":
        pytest.skip("NOT TESTED without a C compiler: the reference kernel needs 15 minutes")
    assert run_gait_demo() == GOLDEN.gait_best


@pytest.mark.slow
def test_the_demos_search_begins_as_it_did(backend: Backend) -> None:
    if backend == "reference":
        pytest.skip("NOT TESTED without a C compiler: the reference kernel needs 15 minutes")
    iterations, _ = run_demo(3)
    assert iterations == GOLDEN.iterations[:3]
    assert [len(iteration.fitness) for iteration in iterations] == [10] * 3


@pytest.mark.thorough("test_a_walk_has_the_same_bits_at_every_vector_width")
@pytest.mark.variants("AVX2")
@pytest.mark.slow
@pytest.mark.parametrize(
    ("narrow", "without"),
    [(Target(4, "x86-64-v3"), AVX512), (Target(2, ""), f"{AVX512} {AVX2}")],
    ids=["AVX2", "plain"],
)
def test_a_machine_with_narrower_vectors_gives_the_same_bits(
    backend: Backend, narrow: Target, without: str
) -> None:
    if backend == "reference":
        pytest.skip("NOT TESTED without a C compiler: there is no kernel to compile more narrowly")
    narrow = min(narrow, target(), key=lambda candidate: candidate.lanes)
    done = python(
        *("-c", NARROW_MACHINE, str(narrow.lanes), narrow.level, *NARROWLY_WALKED),
        # Of products of matrices as well, which a BLAS library computes by the processor's kind.
        environment={"NPY_DISABLE_CPU_FEATURES": without, "OPENBLAS_CORETYPE": "Prescott"},
    )
    assert done.returncode == 0, done.stderr
    lanes, found = json.loads(done.stdout)
    assert lanes == narrow.lanes
    assert found == {name: GOLDEN.optimum[name] for name in NARROWLY_WALKED}


@pytest.mark.thorough("test_compiled_and_readable_kernel_agree")
@pytest.mark.slow
def test_the_reference_kernel_agrees_to_1e_9() -> None:
    (scenario,) = (scenario for scenario in SCENARIOS if scenario.name == "turn-right-fast")
    found = objectives_of_the_optimum((scenario,), backend="reference")
    kept = {scenario.name: GOLDEN.optimum[scenario.name]}
    assert found == as_kept(kept, "reference")
