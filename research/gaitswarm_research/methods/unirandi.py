"""UniRandi: local search along random directions (Järvi 1973; Csendes et al. 2008)."""

from __future__ import annotations

import math

import numpy as np

from gaitswarm.plugins import RandomNumbers
from gaitswarm_research.methods.local_search import Axes, Point, Walk, gains, judged


def unirandi(
    start: Point,
    axes: Axes,
    random: RandomNumbers,
    step: float,
    tolerance: float,
    least: float = 1e-8,
) -> Walk:
    """Try random directions and their opposites, with doubled steps along a better one.

    The step is halved after two directions without success. The search ends at the smallest step,
    or when the last successful step gained less than the tolerance. An integer variable does not
    change where the step rounds to zero.
    """
    here, failures, is_level = start, 0, False
    while True:
        direction = np.zeros(len(start.unit))
        direction[axes.smooth] = random.normal(len(axes.smooth))
        direction /= math.sqrt(float((direction * direction).sum()))
        for side in (direction, -direction):
            trial = yield from judged(here.unit + step * side)
            if trial.fitness < here.fitness:
                break
        else:
            failures += 1
            if failures == 2:
                step, failures = 0.5 * step, 0
                if step < least or is_level:
                    return here
            continue
        failures = 0
        while trial.fitness < here.fitness:
            is_level = not gains(trial, here, tolerance)
            here, step = trial, 2.0 * step
            trial = yield from judged(here.unit + step * side)
        step *= 0.5
