"""Mesh adaptive direct search: what the adapter adds to NOMAD, and its processes."""

from __future__ import annotations

import os
import select
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from gaitswarm.plugins import Axis, Proposals, RandomNumbers, Space, Start
from gaitswarm_research.methods.mads import MOST_PROCESSES, MadsSettings, mads
from research.tests.searches import MIXED, calls_to, designs_asked, mixed_bowl

pytest.importorskip("PyNomad")


def children() -> set[int]:
    """Processes of NOMAD that this one has, by what the kernel says."""
    found = set()
    for task in Path("/proc/self/task").iterdir():
        for pid in (task / "children").read_text().split():
            if b"nomad_process" in Path(f"/proc/{pid}/cmdline").read_bytes():
                found.add(int(pid))
    return found


def begun(seed: int = 1) -> Proposals:
    """A search that waits for what its first proposal is worth."""
    proposals = mads(MadsSettings(), MIXED, 100, RandomNumbers(seed, 0))
    next(proposals)
    return proposals


def test_integers_and_choices_are_found_with_the_rest() -> None:
    calls = [
        calls_to(0.05, designs_asked("mads", MIXED, mixed_bowl, 300, seed), mixed_bowl)
        for seed in (1, 2, 3)
    ]
    assert np.median(calls) <= 150


def test_a_poll_is_a_block_of_at_most_the_particles() -> None:
    def whole(particles: int) -> list[int]:
        asked = designs_asked("mads", MIXED, mixed_bowl, 60, particles=particles, models=False)
        return [len(designs) for designs in asked]

    assert whole(25)[0] == 1
    # Ten directions in five variables, or fewer where a bound is near.
    assert max(whole(25)) == 2 * MIXED.dimension
    assert max(whole(4)) == 4


def test_no_design_is_judged_twice_while_there_are_others() -> None:
    asked = np.vstack(designs_asked("mads", MIXED, mixed_bowl, 400, models=False))
    assert len(np.unique(asked, axis=0)) == 400


def test_a_search_begins_again_elsewhere_when_its_mesh_is_fine() -> None:
    line = Space.continuous([0.0], [1.0])
    asked = designs_asked(
        "mads", line, lambda x: np.abs(x[:, 0] - 0.3), 120, mesh_tolerance=0.01, models=False
    )
    single = [float(designs[0, 0]) for designs in asked if len(designs) == 1]
    assert max(abs(x - 0.3) for x in single[5:]) > 0.2


def test_a_first_design_that_fails_is_left_for_another_one() -> None:
    asked = designs_asked("mads", MIXED, lambda x: np.full(len(x), np.inf), 8)
    assert [len(designs) for designs in asked] == [1] * 8
    assert len(np.unique(np.vstack(asked), axis=0)) == 8


def test_the_first_poll_is_around_the_best_of_the_start() -> None:
    good = np.array([[0.45, 7.0, 2.0, -1.0, 600.0], [1.5, 2.0, 0.0, 4.0, 100.0]])
    start = Start(MIXED.positions(good), mixed_bowl(good))
    proposals = mads(MadsSettings(), MIXED, 100, RandomNumbers(1, 0), start)
    designs = MIXED.designs(next(proposals))
    proposals.close()
    assert (np.abs(designs - good[0]) <= 0.1001 * MIXED.span + 1.0).all()
    assert not (designs == good[0]).all(axis=1).any()


def test_a_closed_search_leaves_no_process_and_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    before = children()
    proposals = begun()
    assert len(children() - before) == 1
    proposals.send(np.array([1.0]))
    proposals.close()
    assert children() - before == set()
    assert not list(tmp_path.iterdir())


def test_many_searches_share_few_processes_and_keep_their_paths() -> None:
    def next_bits(proposals: Proposals) -> bytes:
        return proposals.send(np.array([1.0])).tobytes()

    before = children()
    alone = []
    for seed in range(MOST_PROCESSES + 2):
        proposals = begun(seed)
        alone.append(next_bits(proposals))
        proposals.close()
    together = [begun(seed) for seed in range(MOST_PROCESSES + 2)]
    assert len(children() - before) <= MOST_PROCESSES
    assert [next_bits(proposals) for proposals in together] == alone
    for proposals in together:
        proposals.close()
    assert children() - before == set()


KILLED = """
import os, signal
from research.tests.test_mads import begun, children
proposals = begun()
print(*children(), flush=True)
os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_killed_search_leaves_no_process() -> None:
    killed = subprocess.run([sys.executable, "-c", KILLED], stdout=subprocess.PIPE, check=False)
    (pid,) = map(int, killed.stdout.split())
    try:
        process = os.pidfd_open(pid)
    except ProcessLookupError:
        return
    ended, _, _ = select.select([process], [], [], 10.0)
    os.close(process)
    assert ended == [process]


LEFT_OPEN = """
import sys
from gaitswarm_research.methods import mads
from research.tests.test_mads import begun
# What a module holds is collected when the names of others are gone.
mads.left_open = begun(), list(sys.modules.values())
"""


def test_a_search_that_is_left_open_ends_with_its_process_and_in_silence() -> None:
    ended = subprocess.run(
        [sys.executable, "-W", "always::ResourceWarning", "-c", LEFT_OPEN],
        capture_output=True,
        text=True,
        check=True,
    )
    assert ended.stderr == ""


def test_a_choice_of_two_is_found() -> None:
    space = Space([Axis(0.0, 1.0), Axis(0.0, 1.0, "categorical")])
    asked = designs_asked("mads", space, lambda x: (x[:, 0] - 0.4) ** 2 + x[:, 1], 60, seed=2)
    assert calls_to(1e-3, asked, lambda x: (x[:, 0] - 0.4) ** 2 + x[:, 1]) <= 60
