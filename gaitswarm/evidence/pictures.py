"""Pictures of a job as SVG, written by hand: the same bytes wherever they are drawn.

Colours follow the page that they are in: text and axes are drawn in its own.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from html import escape
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.views import IterationView

Floats = NDArray[np.float64]

_WIDTH: Final = 720.0
_LEFT: Final = 78.0
_RIGHT: Final = 16.0
_TOP: Final = 30.0
_BOTTOM: Final = 46.0
_BLUE: Final = "#3a6ea5"
_RED: Final = "#d1495b"
_DIGITS: Final = 4
"""Significant ones of numbers at axes."""

Scale = Callable[[float], float]
"""A value to its place in the picture."""


def convergence(iterations: Sequence[IterationView]) -> str:
    """Draw fitness over iterations: best so far, median, and the band from best to worst."""
    height, index = 340.0, [float(i.index) for i in iterations]
    drawn = [v for i in iterations for v in (i.best_so_far, i.best, i.median) if v is not None]
    if not drawn:
        return _figure(height, "Convergence: no design has walked in every scenario", [])
    across = _linear(index[0], max(index[-1], index[0] + 1.0), _LEFT, _WIDTH - _RIGHT)
    up, ticks = _up(drawn, height)
    bottom = height - _BOTTOM
    parts = list(_rows(ticks, up))
    band = [(i, i.best, i.worst) for i in iterations if i.best is not None and i.worst is not None]
    if len(band) > 1:
        lower = [(across(i.index), up(best)) for i, best, _ in band]
        upper = [(across(i.index), max(up(worst), _TOP)) for i, _, worst in reversed(band)]
        parts.append(
            f'<polygon points="{_points([*lower, *upper])}" fill="{_BLUE}" fill-opacity="0.15"/>'
        )
    median = [(across(i.index), up(i.median)) for i in iterations if i.median is not None]
    median = [(x, max(y, _TOP)) for x, y in median]
    parts.append(_line(median, _BLUE, 1.2))
    steps: list[tuple[float, float]] = []
    for i in iterations:
        if i.best_so_far is not None:
            here = (across(i.index), up(i.best_so_far))
            steps += [(here[0], steps[-1][1]), here] if steps else [here]
    parts.append(_line(steps, _RED, 2.2))
    parts += _columns(index, across, bottom)
    parts.append(_text(_LEFT + 8, _TOP - 12, "best so far", colour=_RED))
    parts.append(_text(_LEFT + 90, _TOP - 12, "median and range of an iteration", colour=_BLUE))
    parts.append(_text(_WIDTH / 2, height - 8, "iteration", anchor="middle"))
    parts.append(_upright(height, "fitness, minimized [1]"))
    return _figure(height, "Convergence: fitness over iterations", parts)


def bars(names: Sequence[str], values: Sequence[float | None], *, label: str, title: str) -> str:
    """Draw one bar a name."""
    left, row = 170.0, 30.0
    height = _TOP + row * len(names) + _BOTTOM
    most = max([v for v in values if v is not None], default=1.0) or 1.0
    across = _linear(0.0, most, left, _WIDTH - 90.0)
    parts = []
    for k, (name, value) in enumerate(zip(names, values, strict=True)):
        y = _TOP + row * k
        parts.append(_text(left - 10, y + 19, name, anchor="end"))
        if value is None:
            parts.append(_text(left + 6, y + 19, "failed", colour=_RED))
            continue
        width = across(value) - left
        parts.append(
            f'<rect x="{left:.2f}" y="{y + 5:.2f}" width="{width:.2f}" height="{row - 10:.2f}"'
            f' fill="{_BLUE}"/>'
        )
        parts.append(_text(left + width + 6, y + 19, _number(value)))
    parts.append(_text((left + _WIDTH) / 2, height - 14, label, anchor="middle"))
    return _figure(height, title, parts)


def heat_map(values: Floats, *, across: str, up: str, title: str) -> str:
    """Draw a table of numbers as colours, red above zero and blue below."""
    height = 380.0
    n, m = values.shape
    largest = float(np.abs(values).max()) or 1.0
    width = (_WIDTH - _LEFT - _RIGHT) / n
    tall = (height - _TOP - _BOTTOM) / m
    parts = [
        f'<rect x="{_LEFT + i * width:.2f}" y="{height - _BOTTOM - (j + 1) * tall:.2f}"'
        f' width="{width + 0.5:.2f}" height="{tall + 0.5:.2f}"'
        f' fill="{_colour(float(values[i, j]) / largest)}"/>'
        for i in range(n)
        for j in range(m)
    ]
    parts.append(_text(_WIDTH / 2, height - 12, across, anchor="middle"))
    parts.append(_upright(height, up))
    parts.append(_text(_WIDTH - _RIGHT, _TOP - 10, f"±{_number(largest)}", anchor="end"))
    return _figure(height, title, parts)


def _figure(height: float, title: str, parts: Sequence[str]) -> str:
    body = "\n".join(part for part in parts if part)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH:.0f} {height:.0f}"'
        f' role="img" font-family="system-ui, sans-serif" font-size="13" color="#777">\n'
        f"<title>{escape(title)}</title>\n{body}\n</svg>\n"
    )


def _linear(low: float, high: float, first: float, last: float) -> Scale:
    return lambda value: first + (value - low) / (high - low) * (last - first)


def _up(values: Sequence[float], height: float) -> tuple[Scale, list[float]]:
    """From the bottom to the top, by logarithms where values differ by much; and its ticks."""
    low, high = min(values), max(values)
    if high == low:
        low, high = low - 0.5 * (abs(low) or 1.0), high + 0.5 * (abs(high) or 1.0)
    bottom = height - _BOTTOM
    if low > 0.0 and high / low > 3.0:
        log = _linear(math.log10(low), math.log10(high), bottom, _TOP)
        first, last = math.floor(math.log10(low)), math.ceil(math.log10(high))
        ticks = [f * 10.0**e for e in range(first, last + 1) for f in (1.0, 2.0, 5.0)]
        return lambda value: log(math.log10(value)), [t for t in ticks if low <= t <= high]
    return _linear(low, high, bottom, _TOP), _ticks(low, high)


def _ticks(low: float, high: float) -> list[float]:
    """About five round numbers."""
    rough = (high - low) / 5.0
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(f * power for f in (1.0, 2.0, 5.0, 10.0) if f * power >= rough)
    first = math.ceil(low / step)
    return [k * step for k in range(first, math.floor(high / step) + 1)]


def _rows(ticks: Sequence[float], up: Scale) -> Iterator[str]:
    for value in ticks:
        y = up(value)
        yield (
            f'<line x1="{_LEFT:.2f}" x2="{_WIDTH - _RIGHT:.2f}" y1="{y:.2f}" y2="{y:.2f}"'
            ' stroke="currentColor" stroke-opacity="0.25"/>'
        )
        yield _text(_LEFT - 8, y + 4, _number(value), anchor="end")


def _columns(index: Sequence[float], across: Scale, bottom: float) -> Iterator[str]:
    whole = sorted({round(t) for t in _ticks(index[0], max(index[-1], index[0] + 1.0))})
    for value in whole:
        yield _text(across(float(value)), bottom + 18, str(value), anchor="middle")


def _line(points: Sequence[tuple[float, float]], colour: str, width: float) -> str:
    if not points:
        return ""
    return (
        f'<polyline points="{_points(points)}" fill="none" stroke="{colour}"'
        f' stroke-width="{width}"/>'
    )


def _points(points: Sequence[tuple[float, float]]) -> str:
    return " ".join(f"{x:.2f},{y:.2f}" for x, y in points)


def _text(x: float, y: float, text: str, *, anchor: str = "start", colour: str = "") -> str:
    return (
        f'<text x="{x:.2f}" y="{y:.2f}" text-anchor="{anchor}"'
        f' fill="{colour or "currentColor"}">{escape(text)}</text>'
    )


def _upright(height: float, text: str) -> str:
    y = (height - _BOTTOM + _TOP) / 2
    return (
        f'<text transform="translate(16 {y:.2f}) rotate(-90)" text-anchor="middle"'
        f' fill="currentColor">{escape(text)}</text>'
    )


def _colour(share: float) -> str:
    """White at 0, towards red at 1 and blue at -1."""
    strong = (209, 73, 91) if share > 0.0 else (58, 110, 165)
    mixed = [round(255 + (channel - 255) * min(abs(share), 1.0)) for channel in strong]
    return "#" + "".join(f"{channel:02x}" for channel in mixed)


def _number(value: float) -> str:
    return f"{value:.{_DIGITS}g}"
