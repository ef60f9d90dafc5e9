"""Fair queuing of jobs."""

from __future__ import annotations

from collections import Counter
from itertools import combinations

from hypothesis import given
from hypothesis import strategies as st

from gaitswarm.services.worker.fair_queue import FairQueue


def drain(queue: FairQueue[str]) -> list[str]:
    popped = []
    while (task := queue.pop()) is not None:
        popped.append(task)
    return popped


def test_an_empty_queue_has_no_next_task() -> None:
    assert FairQueue[str]().pop() is None


def test_tasks_of_one_job_leave_in_the_order_they_came_in() -> None:
    queue = FairQueue[str]()
    for cost, task in ((9.0, "long"), (5.0, "middle"), (1.0, "short")):
        queue.push("job", cost, task)
    assert drain(queue) == ["long", "middle", "short"]


def test_the_example_in_the_docstring_holds() -> None:
    queue = FairQueue[str]()
    for flow, cost, task in (("a", 9, "x"), ("a", 9, "y"), ("b", 3, "u"), ("b", 3, "v")):
        queue.push(flow, cost, task)
    assert drain(queue) == ["x", "u", "v", "y"]


def test_a_small_job_need_not_wait_for_a_big_one_that_came_first() -> None:
    queue = FairQueue[str]()
    for _ in range(1000):
        queue.push("big", 10.0, "big")
    for _ in range(3):
        queue.pop()
    queue.push("small", 10.0, "small")
    assert "small" in (queue.pop(), queue.pop())


def test_jobs_share_by_simulated_seconds_and_not_by_tasks() -> None:
    queue = FairQueue[str]()
    for _ in range(200):
        queue.push("fine", 1.0, "fine")
        queue.push("coarse", 10.0, "coarse")
    first = Counter(queue.pop() for _ in range(110))
    assert first["fine"] in range(98, 103) and first["coarse"] in range(8, 13)


def test_a_job_that_was_idle_has_earned_no_credit() -> None:
    queue = FairQueue[str]()
    queue.push("early", 1.0, "early")
    assert queue.pop() == "early"
    for _ in range(100):
        queue.push("steady", 1.0, "steady")
    for _ in range(50):
        queue.pop()
    for _ in range(100):
        queue.push("early", 1.0, "early")
    following = Counter(queue.pop() for _ in range(20))
    assert following["early"] in range(9, 12)


def test_a_job_that_comes_back_for_every_iteration_does_not_jump_the_queue() -> None:
    queue = FairQueue[str]()
    for _ in range(100):
        queue.push("steady", 1.0, "steady")
    popped = Counter[str | None]()
    for _ in range(50):
        if popped["returning"] == sum(popped.values()) - popped["steady"]:
            queue.push("returning", 1.0, "returning")
        popped[queue.pop()] += 1
    assert abs(popped["returning"] - popped["steady"]) <= 1


def test_discarded_tasks_are_gone_and_the_others_are_not() -> None:
    queue = FairQueue[str]()
    for task in ("keep 1", "drop 1", "keep 2", "drop 2"):
        queue.push(task[-1], 1.0, task)
    queue.discard(lambda task: task.startswith("drop"))
    assert len(queue) == 2
    assert drain(queue) == ["keep 1", "keep 2"]


@given(
    st.lists(
        st.one_of(
            st.tuples(st.sampled_from("abc"), st.floats(0.1, 10.0)),
            st.none(),
        ),
        max_size=80,
    )
)
def test_every_task_leaves_once_and_no_job_with_work_falls_behind(
    steps: list[tuple[str, float] | None],
) -> None:
    queue = FairQueue[tuple[str, int]]()
    pushed: list[tuple[str, int]] = []
    popped: list[tuple[str, int]] = []
    costs: dict[int, float] = {}
    for number, step in enumerate(steps):
        if step is None:
            task = queue.pop()
            if task is not None:
                popped.append(task)
        else:
            flow, cost = step
            pushed.append((flow, number))
            costs[number] = cost
            queue.push(flow, cost, (flow, number))
        assert len(queue) == len(pushed) - len(popped)
    left = Counter(flow for flow, _ in pushed) - Counter(flow for flow, _ in popped)
    largest = {
        flow: max((costs[k] for name, k in pushed if name == flow), default=0.0) for flow in "abc"
    }
    served = dict.fromkeys("abc", 0.0)
    while (task := queue.pop()) is not None:
        popped.append(task)
        flow, number = task
        left[flow] -= 1
        served[flow] += costs[number]
        # The bound of start-time fair queuing, while two jobs have work: a task of each.
        for one, other in combinations([name for name in "abc" if left[name] > 0], 2):
            ahead = abs(served[one] - served[other])
            assert ahead <= largest[one] + largest[other] + 1e-9
    assert sorted(popped) == sorted(pushed)
    for flow in "abc":
        numbers = [number for name, number in popped if name == flow]
        assert numbers == sorted(numbers)
