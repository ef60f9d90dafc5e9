"""Order of emitted C statements: each once, after its operands, with few live values."""

from __future__ import annotations

import random
from collections.abc import Iterable, Sequence

import pytest

from gaitswarm.sim.kernel.emitted.emit_c import PATIENCE, REGISTERS, Statement, ordered


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


def by_the_definition(statements: Sequence[Statement]) -> list[str]:
    """Operations in order; preferences are evaluated again before each."""
    operations = [s for s in statements if s.operations]
    number = {name: k for k, s in enumerate(operations) for name in s.defines}
    sources = [{number[name] for name in s.reads if name in number} for s in operations]
    readers = [[j for j, of in enumerate(sources) if k in of] for k in range(len(operations))]
    to_end = [0] * len(operations)
    for k in reversed(range(len(operations))):
        to_end[k] = operations[k].latency + max((to_end[j] for j in readers[k]), default=0)
    written: dict[int, int] = {}
    kept, now = 0, 0

    def more_kept(k: int) -> int:
        last = [j for j in sources[k] if all(r in written or r == k for r in readers[j])]
        return bool(readers[k]) - len(last)

    def preference(k: int) -> tuple[int, ...]:
        there = max((written[j] + operations[j].latency for j in sources[k]), default=0)
        late, newest = max(0, there - now), max((written[j] for j in sources[k]), default=0)
        if kept >= REGISTERS:
            return more_kept(k), late, -to_end[k], -newest, k
        return max(0, late - PATIENCE), -to_end[k], -newest, k

    while len(written) < len(operations):
        ready = [k for k, of in enumerate(sources) if k not in written and of <= written.keys()]
        k = min(ready, key=preference)
        kept += more_kept(k)
        there = max((written[j] + operations[j].latency for j in sources[k]), default=0)
        now = max(now + 1, there)
        written[k] = now
    return [operations[k].text for k in written]


@pytest.mark.parametrize("seed", range(3))
def test_of_those_that_are_ready_the_preferred_one_is_next(seed: int) -> None:
    statements = some_function(seed, 200)
    assert most_kept(list(ordered(statements))) >= REGISTERS
    found = [s.text for s in ordered(statements) if s.operations]
    assert found == by_the_definition(statements)


def test_values_that_are_used_late_are_defined_late() -> None:
    """A hundred quotients, and then their sum, need not be kept all at a time."""
    quotients = [value(f"p{k}", "x", latency=1000) for k in range(100)]
    sums = [value("s0", "p0")]
    sums += [value(f"s{k}", f"s{k - 1}", f"p{k}") for k in range(1, 100)]
    statements = [value("x"), *quotients, *sums]
    assert most_kept(statements) > 90
    assert most_kept(list(ordered(statements))) <= 32


def test_while_registers_are_free_latencies_are_hidden() -> None:
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
