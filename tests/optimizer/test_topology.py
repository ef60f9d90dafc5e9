"""Topologies of swarms."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from numpy.typing import NDArray

from gaitswarm.services.optimizer.search.pso import (
    ParticleSwarm,
    PsoSettings,
    leaders,
    random_informants,
    ring,
)
from gaitswarm.services.optimizer.search.registry import OPTIMIZERS
from gaitswarm.services.optimizer.search.space import Axis, Space

Floats = NDArray[np.float64]

BOX = Space.continuous([0.0, 0.0], [1.0, 1.0])
TOPOLOGY = pytest.mark.parametrize("topology", ["global", "ring", "random"])


def swarm(
    space: Space = BOX, *, particles: int = 6, seed: int = 1, **given: object
) -> ParticleSwarm:
    settings = PsoSettings.model_validate({"particles": particles} | given)
    return ParticleSwarm(settings, space, 100 * particles, seed)


def test_in_a_ring_a_particle_follows_the_best_of_itself_and_both_neighbours() -> None:
    fitness = np.array([0.0, 5.0, 4.0, 3.0, 6.0, 7.0])
    assert leaders(ring(6), fitness).tolist() == [0, 0, 3, 3, 3, 0]


def test_small_rings_are_rings_too() -> None:
    assert leaders(ring(1), np.array([2.0])).tolist() == [0]
    assert leaders(ring(2), np.array([2.0, 1.0])).tolist() == [1, 1]


def test_each_particle_informs_itself_and_those_that_are_drawn() -> None:
    informs, informed = random_informants(np.array([[0.0, 0.99], [0.5, 0.5], [0.4, 0.0]]))
    links = sorted(zip(informs.tolist(), informed.tolist(), strict=True))
    assert links == [(0, 0), (0, 0), (0, 2), (1, 1), (1, 1), (1, 1), (2, 0), (2, 1), (2, 2)]


def test_a_particle_follows_the_best_that_informs_it() -> None:
    fitness = np.array([1.0, 0.0, 2.0, math.inf])
    links = np.array([0, 1, 2, 3, 0, 2]), np.array([0, 1, 2, 3, 2, 3])
    assert leaders(links, fitness).tolist() == [0, 1, 0, 2]


def test_in_a_ring_news_travels_by_one_particle_in_an_iteration() -> None:
    """With nothing but the pull of the leader, only those next to a success move."""
    optimizer = swarm(
        topology="ring", inertia_start=0.0, inertia_end=0.0, cognitive=0.0, velocity_limit=1.0
    )
    start = optimizer.ask()
    optimizer.tell(np.array([1.0] + [math.inf] * 5))
    moved = (optimizer.ask() != start).any(axis=1)
    assert moved.tolist() == [False, True, False, False, False, True]


def test_informants_are_redrawn_when_the_best_is_not_improved() -> None:
    optimizer = swarm(topology="random")
    since = []
    for best in (5.0, 4.0, 4.0, 3.0, math.inf):
        optimizer.ask()
        optimizer.tell(np.array([best] + [9.0] * 5))
        since.append(optimizer.dump()["informed_since"])
    assert since == [0, 0, 3, 3, 5]


def test_how_many_inform_a_particle_varies_about_the_setting() -> None:
    rng = np.random.default_rng(1)
    counts = []
    for _ in range(200):
        _, informed = random_informants(rng.random((25, 3)))
        counts += np.bincount(informed, minlength=25).tolist()
    assert np.mean(counts) == pytest.approx(4.0)
    assert min(counts) == 1 and max(counts) > 7


@TOPOLOGY
def test_a_swarm_of_any_topology_resumes_to_the_same_bits(topology: str) -> None:
    straight, reloaded = (swarm(topology=topology) for _ in range(2))
    for _ in range(20):
        positions = straight.ask()
        state = json.loads(json.dumps(reloaded.dump()))
        reloaded = swarm(topology=topology)
        reloaded.load(state)
        assert reloaded.ask().tobytes() == positions.tobytes()
        for each in (straight, reloaded):
            each.tell(np.square(positions - 0.3).sum(axis=1))


def test_topologies_take_different_paths() -> None:
    paths = set()
    for topology in ("global", "ring", "random"):
        optimizer = swarm(topology=topology)
        for _ in range(4):
            optimizer.tell(np.square(optimizer.ask() - 0.3).sum(axis=1))
        paths.add(optimizer.ask().tobytes())
    assert len(paths) == 3


def test_a_global_swarm_stores_no_informants() -> None:
    assert "informed_since" not in swarm().dump()


@TOPOLOGY
def test_a_swarm_does_not_freeze_in_one_integer(topology: str) -> None:
    """Steps of less than half an integer add up, because positions stay real between designs."""
    space = Space([Axis(0.0, 1000.0, "integer")])
    optimizer = swarm(space, topology=topology, velocity_limit=0.0004, particles=4)
    before = optimizer.ask()
    first = space.designs(before)
    for _ in range(60):
        optimizer.tell(np.abs(space.designs(before)[:, 0] - 500.0))
        after = optimizer.ask()
        assert np.abs(after - before).max() <= 0.4 + 1e-9
        before = after
    crossed = np.abs(space.designs(before) - first)
    assert crossed.max() >= 5.0


def test_the_constriction_preset_is_that_of_the_literature() -> None:
    """chi = 0.7298 for c1 = c2 = 2.05; a velocity's limit is half the range."""
    preset = OPTIMIZERS["pso-constriction"]
    assert isinstance(preset, PsoSettings)
    phi = 4.1
    chi = 2.0 / abs(2.0 - phi - math.sqrt(phi**2 - 4.0 * phi))
    assert (preset.inertia_start, preset.inertia_end) == pytest.approx((chi, chi), abs=5e-5)
    assert (preset.cognitive, preset.social) == pytest.approx((2.05 * chi,) * 2, abs=1e-4)
    assert (preset.velocity_limit, preset.bounds, preset.topology) == (0.5, "reflect", "ring")
