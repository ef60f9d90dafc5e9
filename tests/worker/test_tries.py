"""Retries and duplicates of tasks, without workers."""

from __future__ import annotations

import pytest

from gaitswarm.services.worker.tries import MOST_KILLED, Running, Tries, Verdict, straggler


def test_a_task_is_tried_on_three_workers_and_then_given_up() -> None:
    tries, verdicts = Tries(), []
    for _ in range(MOST_KILLED):
        tries, verdict = tries.sent().lost(suspect=True)
        verdicts.append(verdict)
    assert verdicts == [Verdict.AGAIN, Verdict.AGAIN, Verdict.GIVEN_UP]


def test_a_task_is_not_blamed_for_nodes_that_go() -> None:
    tries = Tries()
    for _ in range(100):
        tries, verdict = tries.sent().lost(suspect=False)
        assert verdict is Verdict.AGAIN
    assert tries.killed == 0


def test_nodes_are_kept_in_mind_on_which_workers_died_of_a_task_and_no_others() -> None:
    tries = Tries()
    for node, suspect in (("a", True), ("b", False), ("", True), ("c", True)):
        tries, _ = tries.sent().lost(suspect=suspect, node=node)
    assert tries.died_on == {"a", "c"}


def test_a_task_with_a_copy_is_not_queued_a_third_time() -> None:
    tries, verdict = Tries().sent().sent().lost(suspect=True)
    assert (tries.under_way, verdict) == (1, Verdict.GOES_ON)
    assert tries.lost(suspect=True)[1] is Verdict.AGAIN


def task(seconds: float, *, predicted: float | None = 1.0, copied: bool = False) -> Running:
    return Running(seconds, predicted, Tries(under_way=1, copied=copied))


def test_the_latest_of_the_overdue_tasks_is_run_twice() -> None:
    running = [task(4.0), task(9.0), task(12.0, predicted=3.0), task(0.5)]
    assert straggler(running, slots=5, waiting=0) == 1


@pytest.mark.parametrize(
    ("running", "slots", "waiting"),
    [
        ([task(2.9)], 2, 0),
        ([task(1.5, predicted=0.1)], 2, 0),
        ([task(1e6, predicted=None)], 2, 0),
        ([task(1e6, copied=True)], 2, 0),
        ([task(1e6)], 1, 0),
        ([task(1e6), task(1.0)], 2, 0),
        ([task(1e6)], 2, 1),
        ([], 2, 0),
    ],
    ids=[
        "less than three times as long",
        "not yet two seconds late",
        "no prediction",
        "has a copy",
        "one slot",
        "no free slot",
        "others wait",
        "nothing runs",
    ],
)
def test_a_task_is_not_run_twice_if(running: list[Running], slots: int, waiting: int) -> None:
    assert straggler(running, slots=slots, waiting=waiting) is None
