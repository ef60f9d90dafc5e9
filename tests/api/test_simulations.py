"""One design walking on request: the real simulator behind HTTP."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import dataclass, field
from typing import Any

import httpx2
import numpy as np
import pytest

from gaitswarm.api.dependencies import ComputingCapacity
from gaitswarm.services.optimizer.jobs.designs import SimulationRequest
from gaitswarm.sim.outcome import OBJECTIVE_NAMES, Status
from gaitswarm.sim.scenario import find_scenario
from gaitswarm.simulation import SimulationView, run_simulation
from tests.api.conftest import Serve
from tests.examples.walks import PUBLISHED_A, SHORT_WALK, short_walk, walk

pytestmark = pytest.mark.slow

REQUEST: dict[str, Any] = {"design": PUBLISHED_A, "scenarios": ["normal-fast"]}


def simulated(client: httpx2.Client, **change: Any) -> dict[str, Any]:
    answer = client.post("/v1/simulations", json={**REQUEST, **change})
    assert answer.status_code == 200, answer.text
    view: dict[str, Any] = answer.json()
    return view


def refused(client: httpx2.Client, **change: Any) -> dict[str, Any]:
    answer = client.post("/v1/simulations", json={**REQUEST, **change})
    assert answer.status_code == 422, answer.text
    problem: dict[str, Any] = answer.json()
    return problem


def test_objectives_are_the_simulators_to_the_last_bit(client: httpx2.Client) -> None:
    view = simulated(client, scenarios=["1", "turn-right-fast"])

    for name, result in view["scenarios"].items():
        outcome = walk(find_scenario(name)).outcome
        assert result["status"] == "ok"
        assert list(result["objectives"]) == list(OBJECTIVE_NAMES)
        assert list(result["objectives"].values()) == outcome.objectives[0].tolist()


def test_a_design_may_give_groups_of_legs_a_gait_of_their_own(client: httpx2.Client) -> None:
    design = PUBLISHED_A | {"gait": "ripple", "duty_factor": 0.7, "stride[front]": 0.05}
    scenario = short_walk(
        gait="ripple", duty_factor=0.7, by_group={"stride[front]": 0.05}, name="short"
    )
    mine = simulated(client, design=design, scenarios=[SHORT_WALK])["scenarios"]["short"]
    theirs = simulated(client, scenarios=[scenario.model_dump()])["scenarios"]["short"]
    assert mine == theirs and mine["gait"]["fewest_feet"] == 4
    problem = refused(client, scenarios=[SHORT_WALK | {"gait": "trot"}])
    assert problem["errors"][0]["field"] == "scenarios.0"
    assert "trot is for 4 legs" in problem["errors"][0]["message"]


def test_the_fitness_is_the_geometric_mean_of_the_utilities(client: httpx2.Client) -> None:
    view = simulated(client, scenarios=["1", "6"], preference="B")

    utilities = [result["utility"] for result in view["scenarios"].values()]
    assert view["fitness"] == pytest.approx(math.prod(utilities) ** 0.5, rel=1e-12)
    assert view["preference"]["bias"][0] == 0.4


def test_a_scenario_and_a_gait_of_ones_own_can_be_walked(client: httpx2.Client) -> None:
    design = {**PUBLISHED_A, "stride": 0.12}
    found = simulated(client, scenarios=[SHORT_WALK], design=design)["scenarios"]["short"]

    walked = walk(short_walk(), design).outcome.objectives[0]
    assert list(found["objectives"].values()) == walked.tolist()
    usual = simulated(client, scenarios=[SHORT_WALK])["scenarios"]["short"]
    assert usual["objectives"]["reciprocal_speed"] > found["objectives"]["reciprocal_speed"]


def test_the_log_has_a_row_for_every_control_tick_with_units(client: httpx2.Client) -> None:
    result = simulated(client, log=True, scenarios=[SHORT_WALK])["scenarios"]["short"]

    columns = result["log"]["columns"]
    ticks = round(SHORT_WALK["cycle_time"] * result["log"]["rate"])
    assert result["log"]["rate"] == 500
    assert {len(column["values"]) for column in columns.values()} == {ticks}
    assert columns["joint_angle"]["unit"] == "rad"
    assert np.shape(columns["foot_force"]["values"]) == (ticks, 6, 3)
    steps = np.diff(columns["time"]["values"])
    assert steps == pytest.approx(np.full(ticks - 1, 0.002))


def test_there_is_no_log_unless_asked_for(client: httpx2.Client) -> None:
    assert simulated(client)["scenarios"]["normal-fast"]["log"] is None


def test_a_walk_that_fails_is_a_result_not_an_error(client: httpx2.Client) -> None:
    weak = {**PUBLISHED_A, "FOR": 250.0}
    view = simulated(client, design=weak, scenarios=[{**SHORT_WALK, "load": 50, "cycles": 3}])

    result = view["scenarios"]["short"]
    assert (result["status"], result["explanation"]) == ("fell", Status.FELL.phrase)
    assert result["utility"] is view["fitness"] is None
    assert result["objectives"] == dict.fromkeys(OBJECTIVE_NAMES)


@pytest.mark.parametrize(
    ("change", "field", "hint"),
    [
        ({"scenarios": ["on-the-moon"]}, "scenarios.0", "known are"),
        ({"scenarios": ["1", "1"]}, "scenarios", "named twice"),
        ({"design": {"I": 0.2}}, "design", "FI1R"),
        ({"design": {**PUBLISHED_A, "warp": 9.0}}, "design", "unknown variable 'warp'"),
        ({"design": {**PUBLISHED_A, "FI1R": -5.0}}, "design", "FI1R"),
        ({"design": {**PUBLISHED_A, "FI1R": "much"}}, "design.FI1R", "number"),
        ({"design": {**PUBLISHED_A, "stride": 0.9}}, "scenarios.0", "misses its foot trajectory"),
        ({"design": {**PUBLISHED_A, "cycle_time": 1e6}}, "scenarios", "300 s allowed"),
        ({"design": {**PUBLISHED_A, "cycle_time": -1.0}}, "scenarios.0", "cycle_time"),
        ({"scenarios": [], "log": True}, "scenarios", "at least 1"),
        ({"controller": "telepathy"}, "controller", "fuzzy-pi"),
    ],
)
def test_a_request_that_makes_no_sense_is_refused_by_field(
    client: httpx2.Client, change: dict[str, Any], field: str, hint: str
) -> None:
    problem = refused(client, **change)

    assert field in [error["field"] for error in problem["errors"]]
    assert hint in problem["detail"]


def test_logs_are_limited_more_than_walks(serve: Serve) -> None:
    client = serve(api_max_logged_seconds=0.5).client

    assert simulated(client, scenarios=[SHORT_WALK])["scenarios"]["short"]["status"] == "ok"
    problem = refused(client, scenarios=[SHORT_WALK], log=True)
    assert "0.5 s allowed with logs" in problem["detail"]


@dataclass
class Gate:
    """Walks on request arrive, begin when it is their turn, and end only when it is open."""

    arrived: threading.Semaphore = field(default_factory=lambda: threading.Semaphore(0))
    begun: threading.Semaphore = field(default_factory=lambda: threading.Semaphore(0))
    opened: threading.Event = field(default_factory=threading.Event)


@pytest.fixture
def gate(monkeypatch: pytest.MonkeyPatch) -> Iterator[Gate]:
    gate = Gate()

    def held(request: SimulationRequest) -> SimulationView:
        gate.begun.release()
        assert gate.opened.wait(20.0)
        return run_simulation(request)

    run = ComputingCapacity.run

    async def arriving(capacity: ComputingCapacity, work: Callable[[], Any]) -> Any:
        gate.arrived.release()
        return await run(capacity, work)

    monkeypatch.setattr(ComputingCapacity, "run", arriving)
    monkeypatch.setattr("gaitswarm.operations.run_simulation", held)
    yield gate
    gate.opened.set()


def test_simulations_beyond_the_capacity_wait(serve: Serve, gate: Gate) -> None:
    client = serve(api_compute_workers=1).client
    with ThreadPoolExecutor(2) as pool:
        answers = [pool.submit(simulated, client, scenarios=[SHORT_WALK]) for _ in range(2)]
        for _ in answers:
            assert gate.arrived.acquire(timeout=20.0)
        assert gate.begun.acquire(timeout=20.0)
        assert not gate.begun.acquire(timeout=0.3)
        gate.opened.set()

    assert [a.result()["scenarios"]["short"]["status"] for a in answers] == ["ok", "ok"]


def test_simulations_beyond_the_queue_are_rejected(serve: Serve, gate: Gate) -> None:
    client = serve(api_compute_workers=1, api_compute_queue=0).client
    with ThreadPoolExecutor(1) as pool:
        first = pool.submit(simulated, client, scenarios=[SHORT_WALK])
        assert gate.begun.acquire(timeout=20.0)
        answer = client.post("/v1/simulations", json={**REQUEST, "scenarios": [SHORT_WALK]})
        gate.opened.set()

    assert answer.status_code == 503
    assert "Retry-After" in answer.headers
    assert first.result()["scenarios"]["short"]["status"] == "ok"


def test_a_stopping_server_answers_what_was_asked_before(serve: Serve, gate: Gate) -> None:
    server = serve(api_compute_workers=1, api_shutdown_seconds=60)
    with ThreadPoolExecutor(2) as pool:
        answers = [pool.submit(simulated, server.client, scenarios=[SHORT_WALK]) for _ in range(2)]
        for _ in answers:
            assert gate.arrived.acquire(timeout=20.0)
        server.stop()
        wait_until_refused(str(server.client.base_url))
        assert not wait(answers, timeout=0.5).done
        gate.opened.set()

    assert [a.result()["scenarios"]["short"]["status"] for a in answers] == ["ok", "ok"]


def wait_until_refused(url: str) -> None:
    """Wait until the port is closed."""
    try:
        while True:
            httpx2.get(f"{url}/v1/healthz", verify=False)
    except httpx2.TransportError:
        return
