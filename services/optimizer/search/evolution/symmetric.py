"""Eigenvectors and products of small matrices, with the same bits on all processors."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_SWEEPS: Final = 30
"""More than any matrix needs: convergence is quadratic."""

_MOST_TERMS: Final = 1 << 21
"""Numbers in memory at once, but those of two rows of the result at least: 16 MiB."""

_NEGLIGIBLE: Final = 1e-15
"""Share of the diagonal below which an element off it is as good as zero."""


def product(left: Floats, right: Floats) -> Floats:
    """Matrix product, summed in the order of the inner index."""
    rows = max(2, _MOST_TERMS // max(1, right.size))
    if len(left) > rows:
        blocks = [left[first : first + rows] for first in range(0, len(left), rows)]
        return np.concatenate([product(block, right) for block in blocks])
    terms = left.T[:, :, np.newaxis] * right[:, np.newaxis, :]
    # Along its first axis, numpy adds one element after the other.
    total: Floats = np.ascontiguousarray(terms).sum(axis=0)
    return total


def eigen(symmetric: Floats) -> tuple[Floats, Floats]:
    """Decompose a symmetric matrix, by Jacobi's rotations (Golub and Van Loan, 8.5)."""
    a, vectors = (symmetric + symmetric.T) * 0.5, np.eye(len(symmetric))
    for _ in range(_SWEEPS):
        turned = False
        for p in range(len(a) - 1):
            for q in range(p + 1, len(a)):
                off, one, other = float(a[p, q]), float(a[p, p]), float(a[q, q])
                if abs(off) <= _NEGLIGIBLE * math.sqrt(abs(one) * abs(other)):
                    continue
                turned = True
                _rotate(a, vectors, p, q)
        if not turned:
            break
    return np.diag(a).copy(), vectors


def _rotate(a: Floats, vectors: Floats, p: int, q: int) -> None:
    """Turn in the plane of two coordinates, so that the element between them vanishes."""
    off = float(a[p, q])
    ratio = (float(a[q, q]) - float(a[p, p])) / (2.0 * off)
    tangent = math.copysign(1.0, ratio) / (abs(ratio) + math.sqrt(1.0 + ratio * ratio))
    cosine = 1.0 / math.sqrt(1.0 + tangent * tangent)
    sine = tangent * cosine
    row_p, row_q = a[p].copy(), a[q].copy()
    a[p], a[q] = cosine * row_p - sine * row_q, sine * row_p + cosine * row_q
    column_p, column_q = a[:, p].copy(), a[:, q].copy()
    a[:, p], a[:, q] = cosine * column_p - sine * column_q, sine * column_p + cosine * column_q
    a[p, q] = a[q, p] = 0.0
    vector_p, vector_q = vectors[:, p].copy(), vectors[:, q].copy()
    vectors[:, p] = cosine * vector_p - sine * vector_q
    vectors[:, q] = sine * vector_p + cosine * vector_q
