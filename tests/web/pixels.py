"""Numeric checks of screenshots."""

from __future__ import annotations

import time
from collections.abc import Callable
from io import BytesIO

import numpy as np
from numpy.typing import NDArray
from playwright.sync_api import Locator

from tests.web.pages import TIMEOUT_MS

Image = NDArray[np.uint8]


def pixels(element: Locator) -> Image:
    """Screenshot of an element: (height, width, 3)."""
    from matplotlib.image import imread

    image = imread(BytesIO(element.screenshot()), format="png")
    return np.round(image[..., :3] * 255).astype(np.uint8)


def painted(element: Locator, holds: Callable[[Image], bool]) -> Image:
    """Screenshot of an element once a condition holds, since a canvas is painted asynchronously."""
    ends = time.monotonic() + TIMEOUT_MS / 1000.0
    while not holds(image := pixels(element)):
        assert time.monotonic() < ends, f"condition not met: {colours(image)} colours"
        element.page.wait_for_timeout(50)
    return image


def colourful(least: int) -> Callable[[Image], bool]:
    """Condition: more colours than `least`."""
    return lambda image: colours(image) > least


def other_than(before: Image) -> Callable[[Image], bool]:
    """Condition: differs from a previous screenshot."""
    return lambda image: not np.array_equal(image, before)


def colours(image: Image) -> int:
    """Number of colours; a blank picture has just a few."""
    red, green, blue = (image[..., k].astype(np.uint32) for k in range(3))
    # Combined into numbers, since sorting triples takes fifty times as long.
    return len(np.unique(red << 16 | green << 8 | blue))
