"""CasADi function -> C on a vector type: one statement per scalar operation, walkers in lanes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any, Final

import casadi

from sim.errors import SimulationError

_BINARY: Final[dict[str, str]] = {
    "OP_ADD": "{0} + {1}",
    "OP_SUB": "{0} - {1}",
    "OP_MUL": "{0} * {1}",
    "OP_FMAX": "vec_max({0}, {1})",
    "OP_FMIN": "vec_min({0}, {1})",
    "OP_LT": "vec_less({0}, {1})",
}
_UNARY: Final[dict[str, str]] = {
    "OP_NEG": "-{0}",
    "OP_SQ": "{0} * {0}",
    "OP_TWICE": "{0} + {0}",
    "OP_SQRT": "vec_sqrt({0})",
    "OP_FABS": "vec_abs({0})",
    "OP_INV": "SPLAT(1.0) / {0}",
}


def emit_c(function: Any, name: str) -> str:
    """C source of `static void <name>(const vec *i0, ..., vec *o0, ...)`.

    Inputs and outputs must not overlap. The sine and cosine of one angle share their range
    reduction, and a divisor used more than once is inverted once.

    Args:
        function: A CasADi function of scalars (`SX`).
        name: Of the C function.

    Returns:
        C text that needs `vec.h`.

    Raises:
        SimulationError: An operation of the function has no rule.
    """
    return _Emitter(function).source(name)


class _Emitter:
    def __init__(self, function: Any) -> None:
        self._function = function
        self._names = {
            getattr(casadi, n): n
            for n in dir(casadi)
            if n.startswith("OP_") and isinstance(getattr(casadi, n), int)
        }
        self._work: dict[int, str] = {}
        self._lines: list[str] = []
        self._circular: set[str] = set()
        self._inverse: set[str] = set()

    def source(self, name: str) -> str:
        f = self._function
        arguments = [f"const vec *restrict i{k}" for k in range(f.n_in())]
        arguments += [f"vec *restrict o{k}" for k in range(f.n_out())]
        divisors = Counter(self._replay(lambda *_: None))
        self._work.clear()
        self._replay(lambda k, op, operands: self._emit(k, op, operands, divisors))
        names = [*(f"i{k}" for k in range(f.n_in())), *(f"o{k}" for k in range(f.n_out()))]
        sizes = [*map(f.nnz_in, range(f.n_in())), *map(f.nnz_out, range(f.n_out()))]
        empty = [f"(void){name};" for name, size in zip(names, sizes, strict=True) if not size]
        body = "\n".join(f"  {line}" for line in [*empty, *self._lines])
        return f"static void {name}({', '.join(arguments)})\n{{\n{body}\n}}\n"

    def _replay(self, visit: Callable[[int, str, list[str]], None]) -> list[str]:
        """Walk the instructions, naming each value once; returns the divisors."""
        f, divisors = self._function, []
        for k in range(f.n_instructions()):
            op = self._names[f.instruction_id(k)]
            if op in ("OP_CONST", "OP_INPUT"):
                operands: list[str] = []
            else:
                operands = [self._work[index] for index in f.instruction_input(k)]
            visit(k, op, operands)
            if op == "OP_DIV":
                divisors.append(operands[1])
            if op != "OP_OUTPUT":
                (target,) = f.instruction_output(k)
                self._work[target] = f"t{k}"
        return divisors

    def _emit(self, k: int, op: str, operands: list[str], divisors: Counter[str]) -> None:
        f = self._function
        if op == "OP_OUTPUT":
            output, element = f.instruction_output(k)
            self._lines.append(f"o{output}[{element}] = {operands[0]};")
            return
        if op == "OP_CONST":
            value = f"SPLAT({float(f.instruction_constant(k)).hex()})"
        elif op == "OP_INPUT":
            argument, element = f.instruction_input(k)
            value = f"i{argument}[{element}]"
        elif op in ("OP_SIN", "OP_COS"):
            value = self._circular_function(op, operands[0])
        elif op == "OP_DIV":
            value = self._quotient(operands, divisors)
        elif op in _BINARY:
            value = _BINARY[op].format(*operands)
        elif op in _UNARY:
            value = _UNARY[op].format(*operands)
        else:
            raise SimulationError(f"the C emitter has no rule for CasADi's {op}")
        self._lines.append(f"const vec t{k} = {value};")

    def _circular_function(self, op: str, angle: str) -> str:
        if angle not in self._circular:
            self._circular.add(angle)
            self._lines.append(f"vec s_{angle}, c_{angle};")
            self._lines.append(f"vec_sincos({angle}, &s_{angle}, &c_{angle});")
        return f"s_{angle}" if op == "OP_SIN" else f"c_{angle}"

    def _quotient(self, operands: list[str], divisors: Counter[str]) -> str:
        dividend, divisor = operands
        if divisors[divisor] == 1:
            return f"{dividend} / {divisor}"
        if divisor not in self._inverse:
            self._inverse.add(divisor)
            self._lines.append(f"const vec r_{divisor} = SPLAT(1.0) / {divisor};")
        return f"{dividend} * r_{divisor}"
