"""A cluster of several raylets: nodes come and go, and bits stay as they are alone."""

from __future__ import annotations

import shutil
import tempfile
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from gaitswarm.services.optimizer.errors import InvalidRequest, KilledWorker
from gaitswarm.services.optimizer.jobs.priority import weight
from gaitswarm.services.runtime import open_evaluator
from gaitswarm.services.worker import joining
from gaitswarm.services.worker.cluster.handshake import Introduction, fingerprint, introducer
from gaitswarm.services.worker.cluster.nodes import Wanted
from gaitswarm.services.worker.cluster.shares import ledger, share
from gaitswarm.sim.case import Walk
from tests.examples.paths import ROOT, copy_package
from tests.examples.processes import eventually, within
from tests.worker import cluster_host, cluster_runner
from tests.worker.cluster_host import Process
from tests.worker.cluster_runner import Deadly, Sleep, Slow
from tests.worker.requests import bits, request, walked_at_once

WANTED = request(300)
SMALL = request(8, job_id="small")


@pytest.fixture(scope="module")
def host() -> Iterator[Process]:
    """Holds a cluster whose head has no CPUs."""
    directory = Path(tempfile.mkdtemp(prefix="gsc-"))
    with pytest.MonkeyPatch.context() as patched:
        for name, value in cluster_host.ray_environment(directory).items():
            patched.setenv(name, value)
        with Process() as process:
            yield process
            process.run(cluster_host.stop)
    shutil.rmtree(directory, ignore_errors=True)


@pytest.fixture(scope="module")
def address(host: Process) -> str:
    return host.run(cluster_host.start)


@pytest.fixture(scope="module")
def runner(address: str) -> Iterator[Process]:
    """A runner that says after a second that it has no node."""
    with Process() as process:
        process.run(cluster_runner.connect, address, patience=1.0)
        yield process
        process.run(cluster_runner.disconnect)


@pytest.fixture
def two_nodes(host: Process, runner: Process) -> list[str]:
    """Ids of two nodes with a CPU each, which the runner has accepted."""
    while len(host.run(cluster_host.nodes)) < 2:
        host.run(cluster_host.add)
    runner.run(cluster_runner.evaluate, SMALL)
    eventually(lambda: runner.run(cluster_runner.slots) == 2)
    return host.run(cluster_host.nodes)


@pytest.fixture(scope="module")
def alone() -> list[tuple[bytes, bytes]]:
    return bits(walked_at_once(WANTED))


def other_version(folder: Path) -> dict[str, str]:
    """The environment of a node that has an older gaitswarm, whose walks differ."""
    shutil.copytree(ROOT / "tests", folder / "tests", ignore=shutil.ignore_patterns("__py*"))
    changed = copy_package(folder) / "sim" / "outcome.py"
    changed.write_text(changed.read_text(encoding="utf-8") + "# older\n", encoding="utf-8")
    metadata = folder / "gaitswarm-0.0.9.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: gaitswarm\nVersion: 0.0.9\n")
    return {"PYTHONPATH": str(folder)}


@pytest.mark.slow
@pytest.mark.timeout(120)
def test_only_nodes_of_this_version_walk_and_without_one_the_reason_is_reported(
    host: Process, runner: Process, tmp_path: Path
) -> None:
    old = host.run(cluster_host.add, environment=other_version(tmp_path))
    here = Introduction.of(introducer()())
    said: list[str] = []

    def is_named() -> bool:
        said.append(runner.run(cluster_runner.why_not, SMALL))
        return "it runs gaitswarm 0.0.9 (code " in said[-1]

    assert within(60.0, is_named), said[-1]
    assert f"not {here.gaitswarm} (code {here.code[:8]})" in said[-1]
    assert f"no node of the Ray cluster may walk for this job. {here.host} (" in said[-1]

    new = host.run(cluster_host.add)
    walked = runner.run(cluster_runner.evaluate, SMALL)
    assert walked == bits(walked_at_once(SMALL))
    assert runner.run(cluster_runner.slots) == 1
    assert runner.run(cluster_runner.logged).count("is not given walks") == 1
    host.run(cluster_host.lose, old)
    assert host.run(cluster_host.nodes) == [new]


@pytest.mark.slow
@pytest.mark.timeout(120)
def test_walks_of_a_node_that_is_lost_are_walked_by_others_to_the_same_bits(
    host: Process, runner: Process, two_nodes: list[str], alone: list[tuple[bytes, bytes]]
) -> None:
    walked = runner.begin(cluster_runner.evaluate, WANTED)
    host.run(cluster_host.lose, two_nodes[0])
    assert walked() == alone
    eventually(lambda: runner.run(cluster_runner.slots) == 1)


@pytest.mark.thorough("test_walks_that_kill_their_workers_are_tried_on_three_and_then_given_up")
@pytest.mark.slow
@pytest.mark.timeout(120)
def test_walks_that_kill_their_worker_are_tried_on_another_node_before_they_are_on_the_same(
    runner: Process, two_nodes: list[str], tmp_path: Path
) -> None:
    case = SMALL.cases[0]
    assert isinstance(case, Walk)
    deadly = Deadly(case, tmp_path / "deaths")
    wanted = replace(SMALL, job_id="deadly", cases=(deadly,), designs=SMALL.designs[:1])

    def are_ready() -> bool:
        runner.run(cluster_runner.evaluate, SMALL)
        return runner.run(cluster_runner.ready_nodes, wanted) == 2

    # This runner waits for a second only while a node is prepared.
    eventually(are_ready)
    with pytest.raises(KilledWorker, match="3 worker processes died"):
        runner.run(cluster_runner.evaluate, wanted)
    first, second, third = deadly.deaths.read_text().split()
    assert first != second
    assert third in {first, second}


@pytest.mark.slow
@pytest.mark.timeout(120)
def test_after_all_nodes_are_gone_and_another_has_come_the_bits_are_the_same(
    host: Process, runner: Process, alone: list[tuple[bytes, bytes]]
) -> None:
    for node in host.run(cluster_host.nodes) or [host.run(cluster_host.add)]:
        host.run(cluster_host.lose, node)
    said = runner.run(cluster_runner.why_not, WANTED)
    assert "no node of the Ray cluster has a CPU" in said
    host.run(cluster_host.add)
    assert runner.run(cluster_runner.evaluate, WANTED) == alone


@pytest.mark.slow
@pytest.mark.timeout(120)
def test_tasks_that_are_no_longer_awaited_leave_their_slots(
    runner: Process, two_nodes: list[str]
) -> None:
    case = WANTED.cases[0]
    assert isinstance(case, Walk)
    endless = replace(WANTED, job_id="endless", cases=(Sleep(case),))
    assert runner.run(cluster_runner.begin_and_stop, endless, 3.0) == "stopped"
    # Otherwise its tasks, of a minute each, would be before these.
    begun = time.monotonic()
    assert runner.run(cluster_runner.evaluate, SMALL) == bits(walked_at_once(SMALL))
    assert time.monotonic() - begun < 30.0


@pytest.mark.slow
@pytest.mark.timeout(120)
def test_two_runners_share_the_slots_while_both_have_jobs(
    address: str, runner: Process, two_nodes: list[str], alone: list[tuple[bytes, bytes]]
) -> None:
    case = WANTED.cases[0]
    assert isinstance(case, Walk)
    long = replace(request(2_000, job_id="long"), cases=(Slow(case),))
    with Process() as other:
        # From a machine that is none of the cluster's: it joins, without CPUs, and leaves.
        other.run(cluster_runner.connect_from_elsewhere, address)
        assert sorted(runner.run(cluster_runner.nodes_of_cluster)) == [0, 0, 1, 1]
        both = [process.begin(cluster_runner.least_slots, long, 1) for process in (runner, other)]
        assert [least() for least in both] == [1, 1]
        assert runner.run(cluster_runner.evaluate, WANTED) == alone
        other.run(cluster_runner.disconnect)
    eventually(lambda: sorted(runner.run(cluster_runner.nodes_of_cluster)) == [0, 1, 1])


@pytest.mark.slow
@pytest.mark.timeout(120)
def test_an_autoscaler_sees_that_as_many_slots_again_are_wanted_while_all_have_work(
    runner: Process, two_nodes: list[str]
) -> None:
    long = request(20_000, job_id="long")
    assert runner.run(cluster_runner.demand_shown, long, expected=2) == 2
    assert runner.run(cluster_runner.demand_shown, None, expected=0) == 0


def test_a_node_is_refused_for_other_code_or_other_rounding_and_not_for_another_level() -> None:
    here = Introduction("head", "0.1.0", "c" * 32, "a" * 32, "x86-64-v4")
    assert replace(here, host="node-3", level="x86-64-v3").refusal(here) is None
    older = replace(here, gaitswarm="0.0.9", code="d" * 32)
    assert (
        older.refusal(here) == "it runs gaitswarm 0.0.9 (code dddddddd), not 0.1.0 (code cccccccc)"
    )
    rounds = replace(here, arithmetic="b" * 32, level="x86-64-v3").refusal(here)
    assert rounds is not None
    assert "other bits on x86-64-v3 than this runner's on x86-64-v4" in rounds


def test_a_node_introduces_itself_in_whatever_version() -> None:
    said = introducer()()
    assert Introduction.of(said).refusal(Introduction.of(said | fingerprint())) is None
    later = said | {"colour": "blue"}
    assert Introduction.of(later) == Introduction.of(said)
    without = {"host": "node-3", "gaitswarm": "none", "problem": "ModuleNotFoundError: services"}
    refused = Introduction.of(without).refusal(Introduction.of(said))
    assert refused is not None
    assert "gaitswarm none" in refused and "ModuleNotFoundError: services" in refused


@pytest.mark.parametrize(
    ("slots", "own", "total", "expected"),
    [
        (8, 1, 1, 8),
        (8, 1, 2, 4),
        (8, 1, 3, 3),
        (8, 3, 4, 6),
        (8, 1, 20, 1),
        (8, 0, 5, 8),
        (0, 1, 2, 1),
    ],
)
def test_shares_are_in_proportion_to_jobs_and_leave_no_slot_idle(
    slots: int, own: float, total: float, expected: int
) -> None:
    assert share(slots, own, total) == expected


def test_a_job_that_is_three_steps_higher_has_eight_times_the_share_of_a_cluster() -> None:
    assert [share(9, weight(own), weight(0) + weight(3)) for own in (0, 3)] == [1, 8]


def test_a_runner_that_is_silent_for_long_has_no_share() -> None:
    kept = ledger()(10.0)
    assert kept.report("a", 2.0, now=0.0) == 2.0
    assert kept.report("b", 1.0, now=5.0) == 3.0
    assert kept.report("b", 1.0, now=11.0) == 1.0


def test_an_address_of_ray_client_is_refused_with_the_way_out() -> None:
    with pytest.raises(InvalidRequest, match=r"ray_address: 'ray://head:10001' .* HOST:6379"):
        open_evaluator("ray", address="ray://head:10001")


def test_no_node_runs_here_of_a_cluster_that_does_not_exist() -> None:
    assert not joining.runs_here(1)


def test_the_node_of_a_head_that_has_just_begun_to_listen_here_is_waited_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    looks = iter([False, False, True, False])
    monkeypatch.setattr(joining, "runs_here", lambda _port: next(looks))
    assert joining.comes_here("127.0.0.1", 6379)
    # Elsewhere it is not waited for: the address is reserved for documentation.
    assert not joining.comes_here("203.0.113.77", 6379)
    monkeypatch.setattr(joining, "runs_here", lambda _port: False)
    monkeypatch.setattr(joining, "_LATE_SECONDS", 0.3)
    assert not joining.comes_here("127.0.0.1", 6379), "it does not come"


def test_requests_that_need_other_robots_or_another_provenance_have_nodes_prepared_again() -> None:
    assert Wanted.by(WANTED) == Wanted.by(replace(WANTED, job_id="b", designs=WANTED.designs[:1]))
    changed = WANTED.provenance.model_copy(update={"code_digest": "other"})
    assert Wanted.by(WANTED) != Wanted.by(replace(WANTED, provenance=changed))
