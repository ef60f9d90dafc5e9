"""In which order statements are written: no value long before it is used, none waited for long.

Compilers keep the order of a long block of arithmetic by and large, and so CasADi's: it defines a
limb's positions and velocities, and uses most of them hundreds of operations later. By then they
are in memory. Bits do not depend on the order.

The method is integrated prepass scheduling (Goodman and Hsu, Code Scheduling and Register
Allocation in Large Basic Blocks, 1988): while registers are free, what is furthest from the end
goes first; when they are not, what sets most of them free.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

REGISTERS: Final = 31
"""Values that are kept while the furthest from the end goes first: AVX-512's and NEON's registers,
but for one. With the 16 of AVX2, 31 is as good as any number that was tried."""

PATIENCE: Final = 16
"""Statements for which a value may be waited; processors look ahead themselves."""


@dataclass(frozen=True, slots=True)
class Statement:
    """Lines of C.

    Attributes:
        text: The lines.
        defines: Names of the values that are defined.
        reads: Names of values of other statements.
        operations: How many statements of one operation it stands for; 0 for what is an operand
            in memory, a constant or an input, and takes no register until it is used.
        latency: Operations that others could do until its values are there.
    """

    text: str
    defines: tuple[str, ...] = ()
    reads: tuple[str, ...] = ()
    operations: int = 1
    latency: int = 4


def ordered(statements: Sequence[Statement]) -> Iterator[Statement]:
    """The same statements in an order that suits registers and pipelines."""
    return _Schedule(statements).run()


class _Schedule:
    """Statements by number; `sources` are those that one reads from, `readers` the other way."""

    def __init__(self, statements: Sequence[Statement]) -> None:
        self._statements = statements
        by_name = {name: k for k, s in enumerate(statements) for name in s.defines}
        sources = [sorted({by_name[name] for name in s.reads}) for s in statements]
        self._in_memory = [[j for j in of if not statements[j].operations] for of in sources]
        self._sources = [[j for j in of if statements[j].operations] for of in sources]
        self._readers: list[list[int]] = [[] for _ in statements]
        for k, of in enumerate(self._sources):
            for j in of:
                self._readers[j].append(k)
        self._to_end = [0] * len(statements)
        for k in reversed(range(len(statements))):
            further = max((self._to_end[reader] for reader in self._readers[k]), default=0)
            self._to_end[k] = statements[k].latency + further
        self._unread = [len(readers) for readers in self._readers]
        """Readers to come, by statement."""
        self._there = [0] * len(statements)
        """When all that a statement reads is there, as far as is known."""
        self._newest = [0] * len(statements)
        """When the last one was written of those that a statement reads."""
        self._last_reads = [sum(self._unread[j] == 1 for j in of) for of in self._sources]
        """How many values nothing reads after a statement."""
        self._born = [len(s.defines) * bool(self._readers[k]) for k, s in enumerate(statements)]
        """How many values of a statement are read."""
        self._kept = 0
        """Values in registers."""

    def run(self) -> Iterator[Statement]:
        """Write one statement after the other, the preferred one of those that are ready."""
        missing = [len(of) for of in self._sources]
        ready = [k for k, s in enumerate(self._statements) if s.operations and not missing[k]]
        given: set[int] = set()
        written: set[int] = set()
        now = 0
        while ready:
            k = min(ready, key=lambda k: self._preference(k, now))
            ready.remove(k)
            for j in self._in_memory[k]:
                if j not in given:
                    given.add(j)
                    yield self._statements[j]
            yield self._statements[k]
            written.add(k)
            self._kept += self._more_kept(k)
            for j in self._sources[k]:
                self._unread[j] -= 1
                if self._unread[j] == 1:
                    (last,) = (reader for reader in self._readers[j] if reader not in written)
                    self._last_reads[last] += 1
            now = max(now + self._statements[k].operations, self._there[k])
            for reader in self._readers[k]:
                missing[reader] -= 1
                self._there[reader] = max(self._there[reader], now + self._statements[k].latency)
                self._newest[reader] = now
                if not missing[reader]:
                    ready.append(reader)
        for k, statement in enumerate(self._statements):
            if not statement.operations and k not in given:
                yield statement

    def _preference(self, k: int, now: int) -> tuple[int, ...]:
        """The least is written next."""
        late = max(0, self._there[k] - now)
        if self._kept >= REGISTERS:
            return self._more_kept(k), late, -self._to_end[k], -self._newest[k], k
        return max(0, late - PATIENCE), -self._to_end[k], -self._newest[k], k

    def _more_kept(self, k: int) -> int:
        """Values that it defines, less those that nothing reads after it."""
        return self._born[k] - self._last_reads[k]
