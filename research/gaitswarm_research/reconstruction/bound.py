"""Bound on f_G under C from f_G under A, independent of the model, by Jensen's inequality.

With x the logarithms of the objectives, log f_A is a sum of e_m log(b_m + exp x_m), convex in x,
averaged over scenarios. So it is at least its value at the scenarios' mean of x, which are the
logarithms of the geometric means g_m. f_C, without biases, is the product of the g_m.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from gaitswarm import Preference


def greatest_product(preference: Preference, fitness: float, means: Mapping[int, float]) -> float:
    """Return the greatest product of all objectives' geometric means that a fitness allows.

    means: geometric means that are given, by index of the objective.

    The logarithm of the product is linear and the constraint convex, so the stationary point is the
    greatest: all e_m g_m / (b_m + g_m) of the free means are equal.
    """
    terms = list(zip(preference.bias, preference.exponent, strict=True))
    free = [term for m, term in enumerate(terms) if m not in means]
    room = math.log(fitness) - sum(
        terms[m][1] * math.log(terms[m][0] + value) for m, value in means.items()
    )
    least = sum(e * math.log(b) for b, e in free)
    product = math.prod(means.values())
    if not free:
        return product if room >= 0.0 else 0.0
    if room <= least:
        return 0.0
    # Of u, the logarithm of t / (e - t), t the common slope and e the least exponent; t in (0, e).
    low, high = -700.0, 700.0
    for _ in range(200):
        middle = 0.5 * (low + high)
        at_middle = _means(free, middle)
        spent = sum(e * math.log(b + g) for (b, e), g in zip(free, at_middle, strict=True))
        low, high = (middle, high) if spent < room else (low, middle)
    return product * math.prod(_means(free, low))


def _means(free: list[tuple[float, float]], u: float) -> list[float]:
    """Means g_m at which every slope e g / (b + g) is t."""
    least = min(e for _, e in free)
    slack = least / (1.0 + math.exp(u))
    return [b * (least - slack) / (e - least + slack) for b, e in free]
