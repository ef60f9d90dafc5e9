"""Vector operations: the same bits on every target."""

from __future__ import annotations

import ctypes
import itertools
import math
from collections.abc import Sequence
from fractions import Fraction
from functools import cache
from typing import Any, Final

import numpy as np
import pytest
from numpy.typing import NDArray

from gaitswarm.sim.compiler.compilation import (
    X86,
    X86_TARGETS,
    Target,
    cpu_flags,
    host_architecture,
    load_library,
    target,
    vector_header,
)
from gaitswarm.sim.kernel import Precision

pytestmark = pytest.mark.slow

Reals = NDArray[np.floating[Any]]

PRECISIONS: Final[tuple[Precision, ...]] = ("double", "single")
TYPES: Final[dict[str, Any]] = {"double": np.float64, "single": np.float32}

INF, NAN = math.inf, math.nan
SPECIAL: Final[tuple[float | str, ...]] = (
    *(0.0, -0.0, 1.0, -1.0),
    *("tiny", "small", "huge"),
    *(INF, -INF, NAN),
)
"""Numbers that rules have exceptions for; those in words are of each type's own."""

HERE: Final = tuple(
    dict.fromkeys(
        [
            *(aim for aim, needed in X86_TARGETS.items() if needed <= cpu_flags()),
            *([Target(2, "", X86)] if host_architecture() == X86 else []),
            target(),
        ]
    )
)
"""Targets that this machine runs."""

FUNCTIONS: Final = """
static vec all(real x)
{
  vec r;
  for (int k = 0; k < LANES; k++) r[k] = x; /* SPLAT takes the sign of a zero */
  return r;
}
void gaitswarm_fused(const real *a, const real *b, const real *c, real *r, int64_t n)
{
  for (int64_t k = 0; k < n; k++) {
    const vec x = all(a[k]), y = all(b[k]), z = all(c[k]);
    r[3 * k] = vec_fma(x, y, z)[0];
    r[3 * k + 1] = vec_fms(x, y, z)[LANES - 1];
    r[3 * k + 2] = vec_fnma(x, y, z)[LANES / 2];
  }
}
void gaitswarm_others(const real *a, const real *b, real *r, int64_t n)
{
  for (int64_t k = 0; k < n; k++) {
    const vec x = all(a[k]), y = all(b[k]);
    vec sine, cosine;
    vec_sincos(x, &sine, &cosine);
    const vec found[] = {vec_max(x, y), vec_min(x, y), vec_less(x, y), vec_abs(x), vec_sqrt(x),
                         sine, cosine, vec_exp(x), vec_pow(vec_abs(x), vec_abs(y))};
    for (int i = 0; i < 9; i++) r[9 * k + i] = found[i][k % LANES];
  }
}
"""


def source(precision: Precision) -> str:
    """`FUNCTIONS` for doubles or floats."""
    return "#define SINGLE\n" * (precision == "single") + vector_header() + FUNCTIONS


RESULTS = {"fused": 3, "others": 9}
"""Of each function."""


def call(aim: Target, name: str, *inputs: Reals) -> Reals:
    """What one of `FUNCTIONS` gives, (n, RESULTS), compiled for a target."""
    kind = inputs[0].dtype
    text = source("single" if kind == np.float32 else "double")
    library = load_library("vectors", text.encode(), lambda: text, compile_for=aim)
    assert library is not None
    output = np.empty((len(inputs[0]), RESULTS[name]), dtype=kind)
    pointers = [ctypes.c_void_p(array.ctypes.data) for array in (*inputs, output)]
    getattr(library, f"gaitswarm_{name}")(*pointers, ctypes.c_int64(len(output)))
    return output


def bits(values: Reals) -> NDArray[Any]:
    """Bit patterns; what sign a NaN has is the compiler's choice."""
    positive = np.where(np.isnan(values), np.array(np.nan, values.dtype), values)
    return positive.view(np.int64 if values.dtype == np.float64 else np.int32)


def specials(precision: Precision) -> list[float]:
    info = np.finfo(TYPES[precision])
    named = {
        "tiny": float(info.smallest_subnormal),
        "small": -float(info.smallest_normal),
        "huge": 0.9 * float(info.max),
    }
    return [named[x] if isinstance(x, str) else x for x in SPECIAL]


@cache
def triples(precision: Precision) -> tuple[Reals, ...]:
    """Special values, numbers of all sizes, and sums that cancel or are close to a tie."""
    info = np.finfo(TYPES[precision])
    digits, largest = info.nmant + 1, info.maxexp
    ulp, count = 2.0**-info.nmant, 3000
    generator = np.random.default_rng(7)
    powers = generator.integers(-largest + 2 - digits // 2, largest - 4, (count, 3))
    wild = generator.normal(size=(count, 3)) * 2.0**powers
    near = generator.normal(size=(count, 3)).astype(info.dtype).astype(float)
    near[:, 2] = -near[:, 0] * near[:, 1] * (1 + ulp * generator.integers(-2, 3, count))
    small = near * 2.0 ** -(largest // 2 + generator.integers(-10, 20, (count, 1)))
    ties = generator.integers(1, 2 ** (digits // 2), (count, 3)) * 1.0
    ties[:, 2] *= 2.0 ** generator.integers(-digits, digits, count)
    nearly = ties * (1 + ulp * generator.integers(0, 2, ties.shape))
    # Products whose upper half ties with the addend's last bit, and whose lower half decides.
    close = 2.0 ** -generator.integers(digits // 2, digits // 2 + 10, count)
    decided = np.column_stack(
        [
            1.0 + close,
            (1.0 - close) * 2.0**-digits * generator.choice([-1.0, 1.0], count),
            1.0 + ulp * generator.integers(0, 2 ** (digits - 1), count),
        ]
    )
    special = np.array(list(itertools.product(specials(precision), repeat=3)))
    every = np.concatenate([special, wild, near, small, ties, nearly, decided]).astype(info.dtype)
    return tuple(np.ascontiguousarray(column) for column in every.T)


def rounded_once(a: float, b: float, c: float, info: Any) -> float:
    """The number of a type nearest to a b + c, by rational numbers."""
    if not (math.isfinite(a) and math.isfinite(b)):
        return a * b + c
    if not math.isfinite(c):
        return c
    exact = Fraction(a) * Fraction(b) + Fraction(c)
    sign = math.copysign(1.0, a) * math.copysign(1.0, b)
    if exact == 0:
        both = (a == 0 or b == 0) and c == 0 and sign == math.copysign(1.0, c)
        return math.copysign(0.0, sign) if both else 0.0
    size = abs(exact)
    exponent = size.numerator.bit_length() - size.denominator.bit_length()
    exponent -= Fraction(2) ** exponent > size
    quantum = Fraction(2) ** max(exponent - info.nmant, info.minexp - info.nmant)
    rounded = round(size / quantum) * quantum
    value = INF if rounded >= Fraction(2) ** info.maxexp else float(rounded)
    return value if exact > 0 else -value


def expected_of_fused(columns: Sequence[Reals]) -> Reals:
    info = np.finfo(columns[0].dtype)
    rows = zip(*(column.tolist() for column in columns), strict=True)
    return np.array(
        [[rounded_once(a * s, b, c * t, info) for s, t in SIGNS] for a, b, c in rows],
        dtype=info.dtype,
    )


SIGNS: Final = ((1, 1), (1, -1), (-1, 1))
"""Of product and addend in a b + c, a b - c and c - a b."""


@pytest.mark.thorough("test_a_product_used_only_in_sums_is_fused")
@pytest.mark.variants("single")
@pytest.mark.parametrize("precision", PRECISIONS)
def test_products_and_sums_are_rounded_once(precision: Precision) -> None:
    columns = triples(precision)
    expected = expected_of_fused(columns)
    for aim in HERE:
        found = call(aim, "fused", *columns)
        wrong = np.flatnonzero((bits(found) != bits(expected)).any(axis=1))
        rows = [([float(x[k]) for x in columns], found[k], expected[k]) for k in wrong[:3]]
        assert (aim, len(wrong), rows) == (aim, 0, [])


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("aim", HERE, ids=str)
def test_of_a_nan_or_two_zeros_the_second_operand_is_the_larger_and_the_smaller(
    aim: Target, precision: Precision
) -> None:
    pairs = list(itertools.product(specials(precision), repeat=2))
    a, b = (np.array(side, dtype=TYPES[precision]) for side in zip(*pairs, strict=True))
    larger, smaller = call(aim, "others", a, b)[:, :2].T
    np.testing.assert_array_equal(bits(larger), bits(np.where(a > b, a, b)))
    np.testing.assert_array_equal(bits(smaller), bits(np.where(a < b, a, b)))


@pytest.mark.parametrize("precision", PRECISIONS)
def test_every_target_gives_the_bits_of_the_widest(precision: Precision) -> None:
    a, b, _ = triples(precision)
    widest = bits(call(target(), "others", a, b))
    for aim in HERE:
        np.testing.assert_array_equal(bits(call(aim, "others", a, b)), widest, err_msg=str(aim))


@pytest.mark.parametrize("precision", PRECISIONS)
def test_powers_are_accurate_and_zero_stays_about_zero(precision: Precision) -> None:
    kind, accuracy = TYPES[precision], {"double": 1e-13, "single": 2e-5}[precision]
    a = np.concatenate([np.linspace(0.0, 20.0, 401), np.geomspace(1e-6, 1e3, 100)]).astype(kind)
    for exponent in (0.25, 0.84, 3.0, 8.7):
        b = np.full_like(a, exponent)
        *_, exponential, power = call(target(), "others", a, b).T
        wide, steep = a.astype(np.float64), b.astype(np.float64)
        kept = wide < 80.0
        np.testing.assert_allclose(exponential[kept], np.exp(wide[kept]), rtol=accuracy)
        np.testing.assert_allclose(power, wide**steep, rtol=accuracy, atol=1e-9)
