"""Contract suites that a plug-in's own tests subclass.

They are plain classes of `test_` methods, for pytest or any compatible runner; no test runner is
imported. The subject is looked up by name, so that its entry point is tested, too.
"""

from __future__ import annotations

import json
import math
import pickle
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import cache
from multiprocessing import get_context
from types import MappingProxyType
from typing import Any, ClassVar, Final
from unittest import TestCase

import numpy as np

from gaitswarm.services.optimizer.search.optimizer import Optimizer
from gaitswarm.services.optimizer.search.registry import METHODS
from gaitswarm.services.optimizer.search.space import Axis, Space
from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.case import Case, LongCase, Walk, run_together
from gaitswarm.sim.case_registry import CASES, CaseSettings, create_case
from gaitswarm.sim.catalogue import GAIT_CATALOGUE, check_design, with_gait
from gaitswarm.sim.controllers import CONTROLLERS, Controller, names_of
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.kernel.walk import check_gains
from gaitswarm.sim.outcome import Outcome, Status
from gaitswarm.sim.robot import DEFAULT_ROBOT, RobotSource, load_robot
from gaitswarm.sim.scenario import find_scenario
from gaitswarm.sim.simulate import simulate

refused = TestCase().assertRaisesRegex


class CaseContract:
    """Tests of a registered case. They evaluate two designs several times.

    Attributes:
        name: Of the case.
        settings: Settings other than the defaults, fast ones.
        scenario: The scenario, of which one cycle is simulated.
        controller: Of the walk.
        designs: Values of the controller's variables, by name, of designs that succeed.
    """

    name: str
    settings: Mapping[str, Any] = MappingProxyType({})
    scenario: str = "normal-fast"
    controller: str = "p"
    designs: tuple[Mapping[str, float], ...] = (
        MappingProxyType({"P": 0.25}),
        MappingProxyType({"P": 0.5}),
    )
    evaluated: ClassVar[Outcome]

    @property
    def read_settings(self) -> CaseSettings:
        """Return the settings as in a job."""
        return CASES[self.name].settings.model_validate({"name": self.name, **self.settings})

    @property
    def walk(self) -> Walk:
        """The walk that the case replaces."""
        names = tuple(variable.name for variable in CONTROLLERS[self.controller].variables)
        scenario = find_scenario(self.scenario).model_copy(update={"cycles": 1.0})
        return Walk(DEFAULT_ROBOT, self.controller, scenario, names)

    @property
    def case(self) -> Case:
        return create_case(self.read_settings, self.walk)

    @property
    def rows(self) -> Floats:
        return np.array([[design[n] for n in self.walk.variables] for design in self.designs])

    def test_settings_come_back_from_their_document(self) -> None:
        settings = self.read_settings
        assert type(settings).model_validate(settings.model_dump(mode="json")) == settings
        assert settings.name == self.name
        document = {**settings.model_dump(), "no_such_setting": 1}
        refused(ValueError, "no_such_setting", type(settings).model_validate, document)

    def test_it_stands_for_the_walk(self) -> None:
        case, walk = self.case, self.walk
        assert isinstance(case, Case)
        for name in ("name", "robots", "objectives"):
            assert getattr(case, name) == getattr(walk, name)
        assert case.duration > 0.0 and math.isfinite(case.duration)

    @property
    def outcome(self) -> Outcome:
        """Outcome of the designs, evaluated once for all tests."""
        contract = type(self)
        if "evaluated" not in vars(contract):
            contract.evaluated = self.checked(self.case.run(self.rows), len(self.rows))
        return contract.evaluated

    def test_outcomes_are_in_the_order_of_designs_and_designs_do_not_meet(self) -> None:
        case, rows, both = self.case, self.rows, self.outcome
        last = self.checked(case.run(rows[-1:]), 1)
        assert both.objectives[-1:].tobytes() == last.objectives.tobytes()
        assert both.statuses[-1:].tobytes() == last.statuses.tobytes()
        turned = self.checked(case.run(rows[::-1]), len(rows))
        assert turned.objectives[::-1].tobytes() == both.objectives.tobytes()
        self.checked(case.run(rows[:0]), 0)

    def test_another_process_gets_the_same_case(self) -> None:
        copy = pickle.loads(pickle.dumps(self.case))  # noqa: S301 - written by the line itself
        assert copy.run(self.rows).objectives.tobytes() == self.outcome.objectives.tobytes()

    def test_together_with_other_cases_it_has_the_same_bits(self) -> None:
        case, rows = self.case, self.rows
        together, _ = run_together([case, self.walk], [rows, rows])
        assert together.objectives.tobytes() == self.outcome.objectives.tobytes()

    def test_the_controller_is_what_drives_it(self) -> None:
        objectives = self.outcome.objectives
        assert objectives[0].tobytes() != objectives[-1].tobytes()

    def test_a_design_that_cannot_be_simulated_is_refused(self) -> None:
        wrong = self.rows.copy()
        wrong[0, 0] = math.nan
        refused(SimulationInputError, self.walk.variables[0], self.case.run, wrong)

    def test_a_pose_out_of_reach_is_a_status(self) -> None:
        far = replace(self.walk, scenario=with_gait(self.walk.scenario, {"stride": 1.0}))
        outcome = create_case(self.read_settings, far).run(self.rows)
        assert (outcome.statuses != Status.OK).all()

    def test_a_long_case_can_be_broken_off(self) -> None:
        case = self.case
        if isinstance(case, LongCase):
            try:
                case.run_until(self.rows, lambda: True)
            except Exception:  # noqa: BLE001 - of any kind, says the protocol
                return
            raise AssertionError("run_until ignored should_stop")

    def checked(self, outcome: Outcome, count: int) -> Outcome:
        """Check the shape, statuses and numbers of an outcome."""
        assert outcome.objectives.shape == (count, len(self.case.objectives))
        assert outcome.objectives.dtype == np.float64 and outcome.statuses.dtype == np.uint8
        assert set(outcome.statuses.tolist()) <= set(Status)
        assert np.isfinite(outcome.objectives[outcome.statuses == Status.OK]).all()
        return outcome


class ControllerContract:
    """Tests of a registered controller.

    Attributes:
        name: Of the controller.
        design: A design that succeeds; the middle of the bounds for missing variables.
        scenario: The scenario.
        robot: The robot.
    """

    name: str
    design: Mapping[str, float] = MappingProxyType({})
    scenario: str = "normal-fast"
    robot: RobotSource = DEFAULT_ROBOT

    @property
    def controller(self) -> Controller:
        return CONTROLLERS[self.name]

    @property
    def walking_design(self) -> dict[str, float]:
        """Value of every variable."""
        middle = {v.name: (v.low + v.high) / 2 for v in self.controller.variables}
        whole = {
            v.name: float(round(middle[v.name]))
            for v in self.controller.variables
            if v.kind != "continuous"
        }
        return middle | whole | dict(self.design)

    def test_names_are_its_own(self) -> None:
        names = [v.name for v in (*self.controller.variables, *self.controller.conventions)]
        assert len(names) == len(set(names))
        assert not set(GAIT_CATALOGUE) & set(names)
        assert self.controller.name == self.name and self.controller.description

    def test_conventions_have_defaults(self) -> None:
        assert all(v.default is not None for v in self.controller.conventions)

    def test_every_corner_of_the_box_is_a_control_law(self) -> None:
        variables = self.controller.variables
        for side in ("low", "high"):
            for one in variables:
                design = {v.name: getattr(v, side) for v in variables}
                other = one.high if side == "low" else one.low
                law = self.controller.compile(design | {one.name: other})
                gains = (law.proportional_gain, law.integral_gain, law.derivative_gain)
                assert all(isinstance(gain, int) for gain in gains)
                robot = load_robot(self.robot)
                servo = robot.servos is not None
                check_gains(law, torque=robot.is_torque_controlled, servo=servo)

    def test_the_same_design_is_the_same_law(self) -> None:
        first, second = (self.controller.compile(self.walking_design) for _ in range(2))
        assert pickle.dumps(first) == pickle.dumps(second)

    def test_a_missing_variable_is_refused_by_name(self) -> None:
        for variable in self.controller.variables:
            design = {n: v for n, v in self.walking_design.items() if n != variable.name}
            refused(SimulationInputError, variable.name, self.controller.compile, design)

    def test_published_designs_are_complete(self) -> None:
        known = names_of(self.controller) | set(GAIT_CATALOGUE)
        for design in self.controller.published.values():
            assert set(design) <= known
            check_design(self.name, design)

    def test_it_walks_to_the_same_bits_alone_and_in_company(self) -> None:
        design = self.walking_design
        designs = np.array([list(design.values())] * 2)
        arguments = (find_scenario(self.scenario), self.name, tuple(design))
        both = simulate(*arguments, designs, robot=self.robot).outcome
        alone = simulate(*arguments, designs[:1], robot=self.robot).outcome
        assert both.objectives[:1].tobytes() == alone.objectives.tobytes()
        assert both.objectives[1:].tobytes() == alone.objectives.tobytes()


SPACES: Final[Mapping[str, Space]] = MappingProxyType(
    {
        "mixed": Space(
            [
                Axis(-1.0, 2.0),
                Axis(0.0, 10.0, "integer"),
                Axis(0.0, 2.0, "categorical"),
                Axis(1500.0, 6000.0),
            ]
        ),
        "one variable": Space([Axis(-3.0, 5.0)]),
        "integers only": Space([Axis(0.0, 3.0, "integer"), Axis(0.0, 1.0, "categorical")]),
    }
)

PARTICLES: Final = 6
BUDGET: Final = 90
BUDGETS: Final = MappingProxyType({"mixed": BUDGET, "one variable": 60, "integers only": 20})
"""Evaluations by space: enough for local searches to restart, and for all of the 8 designs."""
SEED: Final = 3


def search(name: str, space: str = "mixed", *, seed: int = SEED) -> Optimizer:
    """A search before its first ask."""
    method = METHODS[name]
    settings = method.settings.model_validate({"name": name, "particles": PARTICLES})
    return method.create(settings, SPACES[space], BUDGETS[space], seed)


def fitness_of(positions: Floats, space: str = "mixed") -> Floats:
    """A quadratic bowl with a region that fails."""
    box = SPACES[space]
    unit = box.to_unit(box.designs(positions))
    fitness: Floats = np.square(unit - 0.3).sum(axis=1) + 0.1
    fitness[np.sin(40.0 * unit.sum(axis=1)) > 0.95] = math.inf
    return fitness


def answer(name: str, positions: Floats, space: str = "mixed") -> Floats:
    """Results for a method: fitness, or two conflicting objectives."""
    fitness = fitness_of(positions, space)
    if not METHODS[name].multi_objective:
        return fitness
    box = SPACES[space]
    other = np.square(box.to_unit(box.designs(positions)) - 0.6).sum(axis=1)
    return np.column_stack([fitness, np.where(np.isfinite(fitness), other, math.inf)])


def alike(name: str, values: Floats) -> Floats:
    """Results of the given values for a method."""
    return np.column_stack([values] * 2) if METHODS[name].multi_objective else values


def path(
    optimizer: Optimizer,
    name: str,
    space: str = "mixed",
    *,
    evaluations: int | None = None,
    most: int | None = None,
) -> Iterator[Floats]:
    """All positions that a search asks for, one by one; of the whole budget by default."""
    evaluations = BUDGETS[space] if evaluations is None else evaluations
    while optimizer.evaluations < evaluations:
        left = evaluations - optimizer.evaluations
        positions = optimizer.ask(left if most is None else min(most, left))
        yield from positions
        optimizer.tell(answer(name, positions, space))


@cache
def whole_path(name: str, space: str = "mixed", seed: int = SEED) -> Floats:
    """The path of an uninterrupted search, computed once for all tests."""
    found = np.array(list(path(search(name, space, seed=seed), name, space)))
    found.flags.writeable = False
    return found


def best(name: str, seed: int) -> float:
    """Return the least fitness that a search finds."""
    return float(min(fitness_of(whole_path(name, seed=seed))))


def bits(positions: Iterable[Floats]) -> list[bytes]:
    return [position.tobytes() for position in positions]


def through_json(optimizer: Optimizer) -> dict[str, Any]:
    """State after a round trip through JSON."""
    state: dict[str, Any] = json.loads(json.dumps(optimizer.dump(), allow_nan=False))
    return state


def continued(name: str, state: dict[str, Any]) -> list[bytes]:
    """Positions of a search continued from a state, as bytes."""
    optimizer = search(name)
    optimizer.load(state)
    return bits(path(optimizer, name))


@cache
def other_process() -> ProcessPoolExecutor:
    """A new process, the same for all tests."""
    return ProcessPoolExecutor(1, get_context("spawn"))


class OptimizerContract:
    """Tests of a registered search method.

    Attributes:
        name: Of the method.
        reloaded: Evaluations up to which it is reloaded, where loading repeats slow work.
        seeds: Searches to compare with random search.
        better_than_random: Whether its median search of a bowl is.
    """

    name: str
    reloaded: int = BUDGET
    seeds: int = 7
    better_than_random: bool = True

    spaces: ClassVar = SPACES

    def test_every_position_is_finite_and_inside_the_bounds(self) -> None:
        for space, box in self.spaces.items():
            found = whole_path(self.name, space)
            assert found.shape == (BUDGETS[space], box.dimension)
            assert (found >= box.low).all() and (found <= box.high).all()

    def test_the_same_seed_gives_the_same_bits_and_another_one_others(self) -> None:
        first = bits(whole_path(self.name))
        assert bits(path(search(self.name), self.name)) == first
        assert bits(whole_path(self.name, seed=SEED - 1)) != first

    def test_a_dump_loaded_between_any_ask_and_tell_changes_no_bit(self) -> None:
        for space in self.spaces:
            reloaded, found = search(self.name, space), list[bytes]()
            while reloaded.evaluations < min(BUDGETS[space], self.reloaded):
                state = through_json(reloaded)
                # The first copy may share the process's caches; the second cannot.
                for _ in range(2):
                    reloaded = search(self.name, space)
                    reloaded.load(state)
                    reloaded.ask(BUDGETS[space] - reloaded.evaluations)
                positions = reloaded.ask()
                state = through_json(reloaded)
                reloaded = search(self.name, space)
                reloaded.load(state)
                assert reloaded.ask().tobytes() == positions.tobytes()
                found += [position.tobytes() for position in positions]
                reloaded.tell(answer(self.name, positions, space))
            assert found == bits(whole_path(self.name, space))[: len(found)]

    def test_the_path_does_not_depend_on_how_much_is_asked_at_once(self) -> None:
        for most in (1, 4):
            found = bits(path(search(self.name), self.name, most=most))
            assert found == bits(whole_path(self.name))

    def test_asks_are_counted_and_give_no_more_than_the_settings_or_the_caller_allow(self) -> None:
        optimizer, evaluations = search(self.name), 0
        for iteration, most in enumerate((None, 3, 100, 1) * 5):
            assert (optimizer.iteration, optimizer.evaluations) == (iteration, evaluations)
            positions = optimizer.ask(most)
            assert 1 <= len(positions) <= min(PARTICLES, most or PARTICLES)
            evaluations += len(positions)
            optimizer.tell(answer(self.name, positions))

    def test_start_positions_are_asked_for_first_and_survive_a_load(self) -> None:
        box = self.spaces["mixed"]
        start = box.from_unit(np.linspace(0.2, 0.7, 3)[:, np.newaxis] * np.ones(box.dimension))

        def started() -> Optimizer:
            optimizer = search(self.name)
            optimizer.start_from(start)
            return optimizer

        whole = bits(path(started(), self.name, evaluations=30))
        assert whole[: len(start)] == bits(start)
        optimizer, found = started(), list[bytes]()
        while optimizer.evaluations < 30:
            positions = optimizer.ask(30 - optimizer.evaluations)
            found += bits(positions)
            optimizer.tell(answer(self.name, positions))
            state = through_json(optimizer)
            optimizer = started()
            optimizer.load(state)
        assert found == whole
        refused(ValueError, "start", search(self.name).start_from, start + 1e6)

    def test_asking_twice_gives_the_same_positions(self) -> None:
        optimizer = search(self.name)
        first = optimizer.ask()
        first_bits = first.tobytes()
        first[:] = math.nan
        assert optimizer.ask(1).tobytes() == first_bits
        assert (optimizer.iteration, optimizer.evaluations) == (0, 0)

    def test_a_search_goes_on_when_everything_fails_and_when_all_is_equal(self) -> None:
        for space in self.spaces:
            for value in (math.inf, 1.0):
                optimizer, seen = search(self.name, space), set[bytes]()
                while optimizer.evaluations < BUDGETS[space]:
                    positions = optimizer.ask()
                    assert np.isfinite(positions).all()
                    seen |= set(bits(positions))
                    optimizer.tell(alike(self.name, np.full(len(positions), value)))
                assert space != "mixed" or math.isfinite(value) or len(seen) > BUDGET // 2

    def test_a_fitness_that_is_none_is_refused(self) -> None:
        optimizer = search(self.name)
        feedback = alike(self.name, np.zeros(PARTICLES))
        refused(ValueError, "before ask", optimizer.tell, feedback)
        asked = len(optimizer.ask())
        one, two = np.zeros(asked), np.zeros((asked, 1))
        wrong = one if alike(self.name, one).ndim == 2 else two
        for fitness in (
            alike(self.name, np.zeros(asked + 1)),
            wrong,
            alike(self.name, np.full(asked, math.nan)),
            alike(self.name, np.full(asked, -math.inf)),
        ):
            refused(ValueError, "fitness", optimizer.tell, fitness)
        assert optimizer.iteration == 0

    def test_a_damaged_state_is_refused_by_name_and_leaves_the_state_before(self) -> None:
        optimizer = search(self.name)
        optimizer.tell(answer(self.name, optimizer.ask()))
        before = through_json(optimizer)
        optimizer.ask()
        later = through_json(optimizer)
        optimizer.load(before)
        for field, value in (
            ("schema_version", 999),
            ("iteration", -1),
            ("asked", None),
            ("asked", 10**6),
            ("optimizer", "another"),
        ):
            refused(ValueError, field, optimizer.load, later | {field: value})
        without = {name: value for name, value in later.items() if name != "iteration"}
        refused(ValueError, "iteration", optimizer.load, without)
        assert through_json(optimizer) == before

    def test_a_search_is_better_than_random_search_on_a_bowl(self) -> None:
        if self.better_than_random:
            found = [best(self.name, seed) for seed in range(self.seeds)]
            by_chance = [best("random", seed) for seed in range(7)]
            assert np.median(found) < np.median(by_chance)

    def test_another_process_goes_on_with_the_same_bits(self) -> None:
        stopped = search(self.name)
        done = len(list(path(stopped, self.name, evaluations=BUDGET // 2)))
        found = other_process().submit(continued, self.name, through_json(stopped)).result()
        assert found == bits(whole_path(self.name)[done:])
