"""Statements of emitted C: each once, after what it reads, and few values kept at a time."""

from __future__ import annotations

import random
from collections.abc import Iterable, Sequence

import pytest

from sim.kernel.emitted.order import PATIENCE, Statement, ordered


def value(name: str, *reads: str, operations: int = 1, latency: int = 4) -> Statement:
    return Statement(f"{name};", (name,), reads, operations, latency)


def names(statements: Iterable[Statement]) -> list[str]:
    return [name for statement in statements for name in statement.defines]


def most_kept(statements: Sequence[Statement]) -> int:
    """Values of operations that are defined, and read later, at one time."""
    last = {name: k for k, s in enumerate(statements) for name in s.reads}
    kept: set[str] = set()
    most = 0
    for k, statement in enumerate(statements):
        kept = {name for name in kept if last[name] > k}
        if statement.operations:
            kept |= {name for name in statement.defines if last.get(name, k) > k}
        most = max(most, len(kept))
    return most


def some_function(seed: int, size: int = 300) -> list[Statement]:
    """Inputs, then operations on any two values before."""
    rng = random.Random(seed)
    known = [f"in{k}" for k in range(10)]
    statements = [value(name, operations=0, latency=0) for name in known]
    for k in range(size):
        statements.append(value(f"t{k}", *rng.sample(known[-60:], 2), latency=rng.choice([4, 13])))
        known.append(f"t{k}")
    return statements


@pytest.mark.parametrize("seed", range(5))
def test_each_statement_comes_once_and_after_what_it_reads(seed: int) -> None:
    statements = some_function(seed)
    found = list(ordered(statements))
    assert sorted(s.text for s in found) == sorted(s.text for s in statements)
    there: set[str] = set()
    for statement in found:
        assert there.issuperset(statement.reads)
        there |= set(statement.defines)


def test_the_order_is_the_same_on_every_machine() -> None:
    assert list(ordered(some_function(1))) == list(ordered(some_function(1)))


def test_values_that_are_used_late_are_defined_late() -> None:
    """A hundred quotients, and then their sum, need not be kept all at a time."""
    quotients = [value(f"p{k}", "x", latency=1000) for k in range(100)]
    sums = [value("s0", "p0")]
    sums += [value(f"s{k}", f"s{k - 1}", f"p{k}") for k in range(1, 100)]
    statements = [value("x"), *quotients, *sums]
    assert most_kept(statements) > 90
    assert most_kept(list(ordered(statements))) <= 32


def test_while_registers_are_free_nothing_waits_that_others_can_be_done_for() -> None:
    """Of chains that do not depend on one another, none is written to its end before the others."""
    chains = [
        [value(f"{c}{k}", *([f"{c}{k - 1}"] if k else []), latency=3 * PATIENCE) for k in range(4)]
        for c in "abc"
    ]
    found = names(ordered([s for chain in chains for s in chain]))
    assert [name[1] for name in found] == sorted(name[1] for name in found)


def test_an_input_is_read_where_it_is_used_first_and_never_lost() -> None:
    early, late, unread = (value(name, operations=0) for name in ("early", "late", "unread"))
    chain = [
        value("t0", "early"),
        value("t1", "t0"),
        value("t2", "t1", "late"),
        value("t3", "late"),
    ]
    found = names(ordered([unread, late, early, *chain]))
    assert found.index("early") == found.index("t0") - 1
    assert found.index("late") == min(found.index("t2"), found.index("t3")) - 1
    assert found[-1] == "unread"
