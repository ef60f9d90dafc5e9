"""Operations on vectors: the same bits on every target, and the ones that arithmetic asks for."""

from __future__ import annotations

import ctypes
import itertools
import math
from fractions import Fraction
from typing import Final

import numpy as np
import pytest
from numpy.typing import NDArray

from sim.compiler.compilation import load_library, vector_header
from sim.compiler.target import X86, X86_TARGETS, Target, cpu_flags, host_architecture, target

pytestmark = pytest.mark.slow

Floats = NDArray[np.float64]

INF, NAN = math.inf, math.nan
SPECIAL: Final = (0.0, -0.0, 1.0, -1.0, 5e-324, -2.3e-308, 1.7e308, -1e300, 1e-300, INF, -INF, NAN)

HERE: Final = tuple(
    {
        *([t for t, needed in X86_TARGETS.items() if needed <= cpu_flags()]),
        *([Target(2)] if host_architecture() == X86 else []),
        target(),
    }
)
"""Targets that this machine runs."""

SOURCE: Final = (
    vector_header()
    + """
static vec all(double x)
{
  vec r;
  for (int k = 0; k < LANES; k++) r[k] = x; /* SPLAT takes the sign of a zero */
  return r;
}
void gaitswarm_fused(const double *a, const double *b, const double *c, double *r, int64_t n)
{
  for (int64_t k = 0; k < n; k++) {
    const vec x = all(a[k]), y = all(b[k]), z = all(c[k]);
    r[3 * k] = vec_fma(x, y, z)[0];
    r[3 * k + 1] = vec_fms(x, y, z)[LANES - 1];
    r[3 * k + 2] = vec_fnma(x, y, z)[LANES / 2];
  }
}
void gaitswarm_others(const double *a, const double *b, double *r, int64_t n)
{
  for (int64_t k = 0; k < n; k++) {
    const vec x = all(a[k]), y = all(b[k]);
    vec sine, cosine;
    vec_sincos(x, &sine, &cosine);
    const vec found[] = {vec_max(x, y), vec_min(x, y), vec_less(x, y), vec_abs(x), vec_sqrt(x),
                         sine, cosine};
    for (int i = 0; i < 7; i++) r[7 * k + i] = found[i][k % LANES];
  }
}
"""
)


def call(aim: Target, name: str, *inputs: Floats, results: int) -> Floats:
    """What a function of `SOURCE` gives, (n, results), compiled for a target."""
    library = load_library("vectors", SOURCE.encode(), lambda: SOURCE, wanted=aim)
    assert library is not None
    output = np.empty((len(inputs[0]), results))
    pointers = [ctypes.c_void_p(array.ctypes.data) for array in (*inputs, output)]
    getattr(library, f"gaitswarm_{name}")(*pointers, ctypes.c_int64(len(output)))
    return output


def bits(values: Floats) -> NDArray[np.int64]:
    """Bit patterns; what sign a NaN has is the compiler's choice."""
    return np.where(np.isnan(values), np.nan, values).view(np.int64)


def triples() -> tuple[Floats, Floats, Floats]:
    """Special values, numbers of all sizes, and sums that cancel or lie beside a tie."""
    special = np.array(list(itertools.product(SPECIAL, repeat=3)))
    generator = np.random.default_rng(7)
    wild = generator.normal(size=(4000, 3)) * 2.0 ** generator.integers(-1060, 1020, (4000, 3))
    near = generator.normal(size=(4000, 3))
    near[:, 2] = -near[:, 0] * near[:, 1] * (1 + 2.0**-52 * generator.integers(-2, 3, 4000))
    small = near * 2.0 ** generator.integers(-540, -500, (4000, 1))
    short = generator.integers(1, 2**27, (4000, 3)) * 1.0
    ties = np.column_stack(
        [short[:, 0], short[:, 1], short[:, 2] * 2.0 ** generator.integers(-60, 70, 4000)]
    )
    # Products whose upper half ties with the addend's last bit, and whose lower half decides.
    close = 2.0 ** -generator.integers(26, 40, 4000)
    decided = np.column_stack(
        [
            1.0 + close,
            (1.0 - close) * 2.0**-53 * generator.choice([-1.0, 1.0], 4000),
            1.0 + 2.0**-52 * generator.integers(0, 2**52, 4000),
        ]
    )
    nearly = ties * (1 + 2.0**-52 * generator.integers(0, 2, ties.shape))
    a, b, c = np.concatenate([special, wild, near, small, ties, nearly, decided]).T
    return np.ascontiguousarray(a), np.ascontiguousarray(b), np.ascontiguousarray(c)


def rounded_once(a: float, b: float, c: float) -> float:
    """The double nearest to a b + c, by rational numbers."""
    if not (math.isfinite(a) and math.isfinite(b)):
        return a * b + c
    if not math.isfinite(c):
        return c
    exact = Fraction(a) * Fraction(b) + Fraction(c)
    if exact == 0:
        sign = math.copysign(1.0, a) * math.copysign(1.0, b)
        both = a * b == 0.0 and c == 0.0 and sign == math.copysign(1.0, c)
        return math.copysign(0.0, sign) if both else 0.0
    try:
        return float(exact)
    except OverflowError:
        return INF if exact > 0 else -INF


@pytest.mark.parametrize("aim", HERE, ids=str)
def test_products_and_sums_are_rounded_once(aim: Target) -> None:
    a, b, c = triples()
    expected = np.array(
        [
            (rounded_once(x, y, z), rounded_once(x, y, -z), rounded_once(-x, y, z))
            for x, y, z in zip(a.tolist(), b.tolist(), c.tolist(), strict=True)
        ]
    )
    found = call(aim, "fused", a, b, c, results=3)
    wrong = np.flatnonzero((bits(found) != bits(expected)).any(axis=1))
    assert [(a[k], b[k], c[k], found[k], expected[k]) for k in wrong[:3]] == []


@pytest.mark.parametrize("aim", HERE, ids=str)
def test_of_a_nan_or_two_zeros_the_second_operand_is_the_larger_and_the_smaller(
    aim: Target,
) -> None:
    a, b = (np.array(side) for side in zip(*itertools.product(SPECIAL, repeat=2), strict=True))
    larger, smaller = call(aim, "others", a, b, results=7)[:, :2].T
    np.testing.assert_array_equal(bits(larger), bits(np.where(a > b, a, b)))
    np.testing.assert_array_equal(bits(smaller), bits(np.where(a < b, a, b)))


@pytest.mark.parametrize("aim", HERE, ids=str)
def test_every_target_gives_the_bits_of_the_widest(aim: Target) -> None:
    a, b, _ = triples()
    assert np.array_equal(
        bits(call(aim, "others", a, b, results=7)), bits(call(target(), "others", a, b, results=7))
    )
