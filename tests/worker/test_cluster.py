"""A cluster of several raylets: nodes come and go, and bits stay as they are alone."""

from __future__ import annotations

import shutil
import tempfile
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.store import Store
from gaitswarm.services.runtime import run_embedded
from gaitswarm.services.worker import ray_node
from gaitswarm.services.worker.dispatch import InProcessEvaluator
from gaitswarm.sim.case import Walk
from tests.examples.jobs import LONG_SPEC, history
from tests.examples.paths import ROOT, copy_package
from tests.worker import cluster_host, cluster_runner
from tests.worker.cases import Slow
from tests.worker.cluster_host import Process
from tests.worker.requests import bits, request, walked_at_once

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
def runner(host: Process) -> Iterator[Process]:
    """From a machine that is no node of the cluster: it joins, without CPUs, and leaves."""
    address = host.run(cluster_host.start)
    with Process() as process:
        process.run(cluster_runner.connect_from_elsewhere, address)
        yield process
        process.run(cluster_runner.disconnect)


def with_nodes(host: Process, runner: Process, count: int) -> list[str]:
    """Ids of so many nodes with a CPU each."""
    while len(host.run(cluster_host.nodes)) < count:
        host.run(cluster_host.add)
    for surplus in host.run(cluster_host.nodes)[count:]:
        host.run(cluster_host.lose, surplus)
    runner.run(cluster_runner.wait_for_slots, count)
    return host.run(cluster_host.nodes)


def other_version(folder: Path) -> dict[str, str]:
    """The environment of a node that has a changed gaitswarm."""
    shutil.copytree(ROOT / "tests", folder / "tests", ignore=shutil.ignore_patterns("__py*"))
    changed = copy_package(folder) / "sim" / "outcome.py"
    changed.write_text(changed.read_text(encoding="utf-8") + "# older\n", encoding="utf-8")
    return {"PYTHONPATH": str(folder)}


@pytest.mark.thorough("a cluster without processors")
@pytest.mark.slow
@pytest.mark.timeout(120)
def test_without_cpus_requests_fail_with_the_reason(host: Process, runner: Process) -> None:
    reason = runner.run(cluster_runner.reason_against, SMALL)
    assert reason == ("EvaluatorUnavailable: no node of the Ray cluster has a CPU for simulations")


@pytest.mark.thorough("test_walks_of_another_provenance_are_refused_in_words")
@pytest.mark.slow
@pytest.mark.timeout(120)
def test_a_worker_of_another_version_is_refused(
    host: Process, runner: Process, tmp_path: Path
) -> None:
    old = host.run(cluster_host.add, environment=other_version(tmp_path))
    runner.run(cluster_runner.wait_for_slots, 1)
    reason = runner.run(cluster_runner.reason_against, SMALL)
    assert reason.startswith("ProvenanceChanged: a worker on ")
    assert "changed simulation code. Its simulations were not used" in reason
    host.run(cluster_host.lose, old)
    runner.run(cluster_runner.wait_for_slots, 0)


@pytest.mark.thorough(
    "test_walks_whose_worker_is_killed_are_walked_again_to_the_same_bits, of a node"
)
@pytest.mark.slow
@pytest.mark.timeout(120)
def test_simulations_of_a_node_that_is_lost_run_on_others_to_the_same_bits(
    host: Process, runner: Process
) -> None:
    nodes = with_nodes(host, runner, 2)
    wanted = request(300)
    (walk, *_) = wanted.cases
    assert isinstance(walk, Walk)
    slow = replace(wanted, cases=(Slow(walk), *wanted.cases[1:]))
    evaluated = runner.begin(cluster_runner.evaluate, slow)
    host.run(cluster_host.lose, nodes[0])
    assert evaluated() == bits(walked_at_once(wanted))
    runner.run(cluster_runner.wait_for_slots, 1)
    assert sorted(runner.run(cluster_runner.nodes_of_cluster)) == [0, 0, 1]


@pytest.mark.thorough("a cluster that grows")
@pytest.mark.slow
@pytest.mark.timeout(120)
def test_an_autoscaler_sees_that_more_cpus_would_be_used(host: Process, runner: Process) -> None:
    with_nodes(host, runner, 1)
    assert runner.run(cluster_runner.demand_seen, request(20_000, job_id="long")) > 0


@pytest.mark.thorough("test_walks_whose_worker_is_killed_are_walked_again_to_the_same_bits")
@pytest.mark.slow
@pytest.mark.timeout(600)
def test_a_job_on_three_nodes_of_which_one_is_lost_every_few_seconds_has_the_same_bits(
    host: Process, runner: Process, store: Store, database: Path
) -> None:
    with_nodes(host, runner, 3)
    spec = JobSpec.model_validate(LONG_SPEC | {"iterations": 24})
    there, here = (store.create_job(spec)[0].id for _ in range(2))
    done, lost = threading.Event(), 0
    ended = runner.begin(cluster_runner.run_job, str(database), there)

    def lose_nodes() -> None:
        nonlocal lost
        while not done.wait(4.0):
            host.run(cluster_host.lose, host.run(cluster_host.nodes)[0])
            host.run(cluster_host.add)
            lost += 1

    losing = threading.Thread(target=lose_nodes)
    losing.start()
    try:
        assert ended() == "succeeded"
    finally:
        done.set()
        losing.join()
    assert lost >= 2
    evaluator = InProcessEvaluator(1)
    run_embedded(store, evaluator, here)
    evaluator.close()
    assert history(store, there) == history(store, here)


@pytest.mark.thorough("the head of a cluster")
@pytest.mark.slow
@pytest.mark.timeout(120)
def test_a_head_that_is_killed_is_noticed_within_seconds(host: Process, runner: Process) -> None:
    """The last test of the cluster."""
    with_nodes(host, runner, 1)
    waiting = runner.begin(cluster_runner.reason_against, request(20_000, job_id="long"))
    # Its cases are in the object store by then, which may be the head's.
    time.sleep(2.0)
    host.run(cluster_host.kill)
    assert (
        waiting() == "EvaluatorUnavailable: Ray was lost: the head of the cluster does not answer"
    )


def test_no_node_runs_here_of_a_cluster_that_does_not_exist() -> None:
    assert not ray_node.runs_here(1)


def test_the_node_of_a_head_that_has_just_begun_to_listen_here_is_waited_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    looks = iter([False, False, True, False])
    monkeypatch.setattr(ray_node, "runs_here", lambda _port: next(looks))
    assert ray_node.comes_here("127.0.0.1", 6379)
    # Elsewhere it is not waited for: the address is reserved for documentation.
    assert not ray_node.comes_here("203.0.113.77", 6379)
    monkeypatch.setattr(ray_node, "runs_here", lambda _port: False)
    monkeypatch.setattr(ray_node, "_LATE_SECONDS", 0.3)
    assert not ray_node.comes_here("127.0.0.1", 6379), "it does not come"
