"""C from symbols: sums of products rounded once, in the same way on every machine."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

import casadi as ca
import numpy as np
import pytest
from numpy.typing import NDArray

from gaitswarm.sim.compiler.compilation import Target, load_library, target, vector_header
from gaitswarm.sim.errors import SimulationError
from gaitswarm.sim.kernel.emitted.emit_c import emit_c

Floats = NDArray[np.float64]

WIDTHS = [target(), Target(4, "x86-64-v3"), Target(2, "")]


def compiled(
    function: Any, wanted: Target, *, start: float = 0.0, added: Sequence[str] = ()
) -> Callable[[Floats], Floats]:
    """From numbers of many walkers, (walkers, inputs), to what a function makes of them.

    start: what is in the place of the outputs before.
    """
    inputs, outputs = function.numel_in(0), function.numel_out(0)
    source = vector_header() + (
        f"{emit_c(function, 'step', added=added)}"
        "void all(const double *in, double *out, int64_t n) {\n"
        f"  for (int64_t at = 0; at < n; at += LANES) {{ vec x[{inputs}], y[{outputs}];\n"
        f"    for (int i = 0; i < {inputs}; i++) for (int k = 0; k < LANES; k++)\n"
        f"      x[i][k] = in[(at + k) * {inputs} + i];\n"
        f"    for (int i = 0; i < {outputs}; i++) y[i] = SPLAT({start});\n"
        "    step(x, y);\n"
        f"    for (int i = 0; i < {outputs}; i++) for (int k = 0; k < LANES; k++)\n"
        f"      out[(at + k) * {outputs} + i] = y[i][k]; }} }}\n"
    )
    aim = wanted if wanted.lanes <= target().lanes else target()
    library = load_library("emitted-check", source.encode(), lambda: source, compile_for=aim)
    assert library is not None

    def call(numbers: Floats) -> Floats:
        out = np.empty((len(numbers), outputs))
        numbers = np.ascontiguousarray(numbers)
        pointers = (ctypes.c_void_p(array.ctypes.data) for array in (numbers, out))
        library.all(*pointers, ctypes.c_int64(len(numbers)))
        return out

    return call


def rounded_once(a: float, b: float, c: float) -> float:
    """a b + c."""
    return float(Fraction(a) * Fraction(b) + Fraction(c))


def numbers_that_cancel(n: int) -> Floats:
    """a, b, c, d, of which a b and c all but cancel, and d is small."""
    rng = np.random.default_rng(2)
    a, b = rng.normal(size=(2, n))
    return np.array(
        [a, b, -a * b * (1.0 + 1e-15 * rng.normal(size=n)), 1e-16 * rng.normal(size=n)]
    ).T


@pytest.mark.parametrize("wanted", WIDTHS, ids=str)
def test_a_product_used_only_in_sums_is_fused(wanted: Target) -> None:
    x: Any = ca.SX.sym("x", 4)
    a, b, c, d = x.elements()
    outputs = [a * b + c, c + a * b, c - a * b, a * b - c, a * b + c * d, a * a + c, (a * b) + d]
    # This one is also read as it is.
    read = b * c
    outputs += [read, read + d]
    numbers = numbers_that_cancel(64)
    found = compiled(ca.Function("f", [x], [ca.vertcat(*outputs)]), wanted)(numbers)
    for row, (a, b, c, d) in zip(found.tolist(), numbers.tolist(), strict=True):
        assert row == [
            rounded_once(a, b, c),
            rounded_once(a, b, c),
            rounded_once(-a, b, c),
            rounded_once(a, b, -c),
            rounded_once(c, d, a * b),
            rounded_once(a, a, c),
            rounded_once(a, b, d),
            b * c,
            b * c + d,
        ]
    plain = numbers[:, 0] * numbers[:, 1] + numbers[:, 2]
    assert (found[:, 0] != plain).mean() > 0.5


def test_everything_that_is_emitted_has_the_same_bits_at_every_vector_width() -> None:
    x: Any = ca.SX.sym("x", 4)
    a, b, c, d = x.elements()
    length = ca.sqrt(a * a + b * b + 1.0)
    outputs = [
        ca.sin(a) * ca.cos(a) - ca.fabs(b) / length,
        ca.fmax(a * b, c) + ca.fmin(a, b) * d,
        (a < b) * c - d / length,
        1.0 / length + 2.0 * a,
        -(b * c) - a,
    ]
    function = ca.Function("f", [x], [ca.vertcat(*outputs)])
    numbers = np.random.default_rng(5).normal(size=(64, 4))
    found = [compiled(function, wanted)(numbers).tobytes() for wanted in WIDTHS]
    assert len(set(found)) == 1
    exact = np.array(function.map(64)(numbers.T)).T
    np.testing.assert_allclose(np.frombuffer(found[0]).reshape(exact.shape), exact, rtol=1e-13)


def test_an_output_may_be_added_to_what_is_there() -> None:
    x: Any = ca.SX.sym("x", 2)
    a, b = x.elements()
    function = ca.Function("f", [x], [ca.vertcat(a * b, -a)], ["x"], ["sums"])
    numbers = np.random.default_rng(6).normal(size=(64, 2))
    expected = np.array([numbers[:, 0] * numbers[:, 1], -numbers[:, 0]]).T
    found = compiled(function, target(), start=3.0)(numbers)
    np.testing.assert_array_equal(found, expected)
    found = compiled(function, target(), start=3.0, added=["sums"])(numbers)
    np.testing.assert_array_equal(found, 3.0 + expected)


def test_an_operation_without_a_rule_is_refused_by_name() -> None:
    x = ca.SX.sym("x")
    with pytest.raises(SimulationError, match=r"no rule for CasADi's OP_TAN$"):
        emit_c(ca.Function("f", [x], [ca.tan(x)]), "f")
