"""CasADi function -> C on a vector type: one statement per scalar operation, one walk per lane.

Compilers mostly keep the order of a long block of arithmetic, and so CasADi's: it defines a limb's
positions and velocities, and uses most of them hundreds of operations later, when they have been
spilled to memory. Statements are therefore reordered by integrated prepass scheduling (Goodman and
Hsu, Code Scheduling and Register Allocation in Large Basic Blocks, 1988): while registers are free,
the statement furthest from the end goes first; otherwise the one that frees most of them. Results
do not depend on the order.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Container, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import casadi

from gaitswarm.sim.errors import SimulationError

REGISTERS: Final = 31
"""Values held while the furthest from the end goes first: the registers of AVX-512 and NEON minus
one. With the 16 of AVX2, 31 was as good as any other number tried."""

PATIENCE: Final = 16
"""Statements that a value may be waited for; processors look ahead themselves."""


@dataclass(frozen=True, slots=True)
class Statement:
    """Lines of C."""

    text: str
    defines: tuple[str, ...] = ()  # names of the defined values
    reads: tuple[str, ...] = ()  # names of values of other statements
    # number of one-operation statements that it counts as; 0 for an operand in memory, a constant
    # or an input, which takes no register until used
    operations: int = 1
    latency: int = 4  # operations that could be executed until its values are available


def ordered(statements: Sequence[Statement]) -> Iterator[Statement]:
    """Order statements for registers and pipelines."""
    return _Schedule(statements).run()


class _Schedule:
    """Statements by number; each reads from its `_sources`, and is read by its `_readers`."""

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
        # Pending readers, by statement.
        self._unread = [len(readers) for readers in self._readers]
        # Time at which the operands written so far are available, by statement.
        self._available = [0] * len(statements)
        # Time at which the last operand was written, by statement.
        self._newest = [0] * len(statements)
        # Number of values that no other statement reads afterwards, by statement.
        self._last_reads = [sum(self._unread[j] == 1 for j in of) for of in self._sources]
        # Number of a statement's values that are read.
        self._born = [len(s.defines) * bool(self._readers[k]) for k, s in enumerate(statements)]
        self._held = 0  # values in registers

    def run(self) -> Iterator[Statement]:
        """Yield the preferred one of the ready statements until none is left."""
        missing = [len(of) for of in self._sources]
        ready = [k for k, s in enumerate(self._statements) if s.operations and not missing[k]]
        loaded: set[int] = set()
        written: set[int] = set()
        now = 0
        while ready:
            k = min(ready, key=lambda k: self._preference(k, now))
            ready.remove(k)
            for j in self._in_memory[k]:
                if j not in loaded:
                    loaded.add(j)
                    yield self._statements[j]
            yield self._statements[k]
            written.add(k)
            self._held += self._more_held(k)
            for j in self._sources[k]:
                self._unread[j] -= 1
                if self._unread[j] == 1:
                    (last,) = (reader for reader in self._readers[j] if reader not in written)
                    self._last_reads[last] += 1
            now = max(now + self._statements[k].operations, self._available[k])
            for reader in self._readers[k]:
                missing[reader] -= 1
                self._available[reader] = max(
                    self._available[reader], now + self._statements[k].latency
                )
                self._newest[reader] = now
                if not missing[reader]:
                    ready.append(reader)
        for k, statement in enumerate(self._statements):
            if not statement.operations and k not in loaded:
                yield statement

    def _preference(self, k: int, now: int) -> tuple[int, ...]:
        """Sort key; the smallest is written next."""
        late = max(0, self._available[k] - now)
        if self._held >= REGISTERS:
            return self._more_held(k), late, -self._to_end[k], -self._newest[k], k
        return max(0, late - PATIENCE), -self._to_end[k], -self._newest[k], k

    def _more_held(self, k: int) -> int:
        """Number of values that it defines minus those read last by it."""
        return self._born[k] - self._last_reads[k]


_BINARY: Final[dict[str, str]] = {
    "OP_MUL": "{0} * {1}",
    "OP_FMAX": "vec_max({0}, {1})",
    "OP_FMIN": "vec_min({0}, {1})",
    "OP_LT": "vec_less({0}, {1})",
    "OP_POW": "vec_pow({0}, {1})",
}
_UNARY: Final[dict[str, str]] = {
    "OP_NEG": "-{0}",
    "OP_SQ": "{0} * {0}",
    "OP_TWICE": "{0} + {0}",
    "OP_SQRT": "vec_sqrt({0})",
    "OP_FABS": "vec_abs({0})",
    "OP_EXP": "vec_exp({0})",
    "OP_INV": "SPLAT(1.0) / {0}",
}

_LATENCIES: Final[dict[str, int]] = {
    "OP_DIV": 13,
    "OP_INV": 13,
    "OP_SQRT": 13,
    "OP_EXP": 70,
    "OP_POW": 150,
}
"""Of operations slower than sums and products [operations executed meanwhile]."""


def emit_c(
    function: Any,
    name: str,
    uniform: Container[str] = (),
    *,
    added: Container[str] = (),
    in_place: bool = False,
) -> str:
    """C source of `static void <name>(const vec *i0, ..., vec *o0, ...)`."""
    return _Emitter(function, uniform, added, in_place=in_place).source(name)


@dataclass(frozen=True, slots=True)
class _Uses:
    """Counts of each value as operand, divisor and term of a sum; factors of the products."""

    operands: Counter[str] = field(default_factory=Counter)
    divisors: Counter[str] = field(default_factory=Counter)
    terms: Counter[str] = field(default_factory=Counter)
    products: dict[str, tuple[str, str]] = field(default_factory=dict)

    def fused(self, value: str) -> bool:
        """Whether a value is a product that is only used as a term of sums."""
        return value in self.products and self.operands[value] == self.terms[value] > 0

    def factors(self, value: str) -> tuple[str, ...]:
        """Values read in place of a value: itself, or the factors if it is fused."""
        return self.products[value] if self.fused(value) else (value,)


def _sum(op: str, operands: list[str], uses: _Uses) -> str:
    a, b = operands
    if uses.fused(b):
        operation = "vec_fma" if op == "OP_ADD" else "vec_fnma"
        return _fused(operation, b, _value(a, uses), uses)
    if uses.fused(a):
        return _fused("vec_fma" if op == "OP_ADD" else "vec_fms", a, b, uses)
    return f"{a} {'+' if op == 'OP_ADD' else '-'} {b}"


def _fused(operation: str, product: str, term: str, uses: _Uses) -> str:
    x, y = uses.products[product]
    return f"{operation}({x}, {y}, {term})"


def _value(name: str, uses: _Uses) -> str:
    """If both terms of a sum are products, the first one is rounded."""
    return " * ".join(uses.products[name]) if uses.fused(name) else name


class _Emitter:
    def __init__(
        self, function: Any, uniform: Container[str], added: Container[str], *, in_place: bool
    ) -> None:
        self._in_place = in_place
        self._added = [function.name_out(k) in added for k in range(function.n_out())]
        self._outputs: list[str] = []
        self._function = function
        self._uniform = [function.name_in(k) in uniform for k in range(function.n_in())]
        self._names = {
            getattr(casadi, n): n
            for n in dir(casadi)
            if n.startswith("OP_") and isinstance(getattr(casadi, n), int)
        }
        self._work: dict[int, str] = {}
        self._statements: list[Statement] = []
        self._circular: set[str] = set()
        self._inverse: set[str] = set()
        self._read: set[str] = set()

    def source(self, name: str) -> str:
        f = self._function
        restrict = "" if self._in_place else "restrict "
        arguments = [
            f"const {'double' if uniform else 'vec'} *{restrict}i{k}"
            for k, uniform in enumerate(self._uniform)
        ]
        arguments += [f"vec *{restrict}o{k}" for k in range(f.n_out())]
        uses = self._uses()
        self._replay(lambda k, op, operands: self._emit(k, op, operands, uses))
        names = [*(f"i{k}" for k in range(f.n_in())), *(f"o{k}" for k in range(f.n_out()))]
        sizes = [*map(f.nnz_in, range(f.n_in())), *map(f.nnz_out, range(f.n_out()))]
        unread = {f"i{k}" for k in range(f.n_in())} - self._read
        empty = [
            f"(void){name};"
            for name, size in zip(names, sizes, strict=True)
            if not size or name in unread
        ]
        lines = [*empty, *(s.text for s in ordered(self._statements)), *self._outputs]
        body = "\n".join(f"  {line}" for line in lines)
        return f"static void {name}({', '.join(arguments)})\n{{\n{body}\n}}\n"

    def _uses(self) -> _Uses:
        uses = _Uses()

        def count(k: int, op: str, operands: list[str]) -> None:
            uses.operands.update(operands)
            if op == "OP_DIV":
                uses.divisors[operands[1]] += 1
            if op in ("OP_ADD", "OP_SUB"):
                uses.terms.update(operands)
            if op in ("OP_MUL", "OP_SQ"):
                uses.products[f"t{k}"] = (operands[0], operands[-1])

        self._replay(count)
        self._work.clear()
        return uses

    def _replay(self, visit: Callable[[int, str, list[str]], None]) -> None:
        """Visit the instructions; each value gets one name."""
        f = self._function
        for k in range(f.n_instructions()):
            op = self._names[f.instruction_id(k)]
            if op in ("OP_CONST", "OP_INPUT"):
                operands: list[str] = []
            else:
                operands = [self._work[index] for index in f.instruction_input(k)]
            visit(k, op, operands)
            if op != "OP_OUTPUT":
                (target,) = f.instruction_output(k)
                self._work[target] = f"t{k}"

    def _emit(self, k: int, op: str, operands: list[str], uses: _Uses) -> None:
        if op == "OP_OUTPUT":
            output, element = self._function.instruction_output(k)
            assign = "+=" if self._added[output] else "="
            line = f"o{output}[{element}] {assign} {operands[0]};"
            if self._in_place:
                self._outputs.append(line)
            else:
                self._statements.append(Statement(line, reads=(operands[0],)))
        elif not uses.fused(f"t{k}"):
            self._define(f"t{k}", *self._result(k, op, operands, uses), op)

    def _define(self, name: str, value: str, reads: Sequence[str], op: str) -> None:
        operations = 0 if op in ("OP_CONST", "OP_INPUT") else 1
        latency = _LATENCIES.get(op, 4) if operations else 0
        text = f"const vec {name} = {value};"
        self._statements.append(Statement(text, (name,), tuple(reads), operations, latency))

    def _result(
        self, k: int, op: str, operands: list[str], uses: _Uses
    ) -> tuple[str, Sequence[str]]:
        """Return an operation's expression and the values that it reads."""
        f = self._function
        reads: Sequence[str] = [x for value in operands for x in uses.factors(value)]
        if op == "OP_CONST":
            value = f"SPLAT({float(f.instruction_constant(k)).hex()})"
        elif op == "OP_INPUT":
            argument, element = f.instruction_input(k)
            self._read.add(f"i{argument}")
            value = f"i{argument}[{element}]"
            if self._uniform[argument]:
                value = f"SPLAT({value})"
        elif op in ("OP_SIN", "OP_COS"):
            value = self._circular_function(op, operands[0])
            reads = [value]
        elif op == "OP_DIV":
            value, reads = self._quotient(operands, uses.divisors)
        elif op in ("OP_ADD", "OP_SUB"):
            value = _sum(op, operands, uses)
        elif op in _BINARY:
            value = _BINARY[op].format(*operands)
        elif op in _UNARY:
            value = _UNARY[op].format(*operands)
        else:
            raise SimulationError(f"the C emitter has no rule for CasADi's {op}")
        return value, reads

    def _circular_function(self, op: str, angle: str) -> str:
        sine, cosine = f"s_{angle}", f"c_{angle}"
        if angle not in self._circular:
            self._circular.add(angle)
            text = f"vec {sine}, {cosine};\n  vec_sincos({angle}, &{sine}, &{cosine});"
            self._statements.append(Statement(text, (sine, cosine), (angle,), 10, 40))
        return sine if op == "OP_SIN" else cosine

    def _quotient(self, operands: list[str], divisors: Counter[str]) -> tuple[str, Sequence[str]]:
        dividend, divisor = operands
        if divisors[divisor] == 1:
            return f"{dividend} / {divisor}", operands
        inverse = f"r_{divisor}"
        if divisor not in self._inverse:
            self._inverse.add(divisor)
            self._define(inverse, f"SPLAT(1.0) / {divisor}", (divisor,), "OP_INV")
        return f"{dividend} * {inverse}", (dividend, inverse)
