"""What a picture of the page shows, as far as numbers can say."""

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
    """An element as it is painted: (height, width, 3)."""
    from matplotlib.image import imread

    image = imread(BytesIO(element.screenshot()), format="png")
    return np.round(image[..., :3] * 255).astype(np.uint8)


def painted(element: Locator, holds: Callable[[Image], bool]) -> Image:
    """The element's picture once it is as it is to be: a canvas is painted after its element is
    there, and after what it shows has changed.
    """
    ends = time.monotonic() + TIMEOUT_MS / 1000.0
    while not holds(image := pixels(element)):
        assert time.monotonic() < ends, f"not painted so: {colours(image)} colours"
        element.page.wait_for_timeout(50)
    return image


def colourful(least: int) -> Callable[[Image], bool]:
    """Whether a picture has more colours than that."""
    return lambda image: colours(image) > least


def other_than(before: Image) -> Callable[[Image], bool]:
    """Whether a picture differs from another one."""
    return lambda image: not np.array_equal(image, before)


def colours(image: Image) -> int:
    """How many colours there are; a blank picture has a handful."""
    red, green, blue = (image[..., k].astype(np.uint32) for k in range(3))
    # As numbers: to sort triples takes fifty times as long.
    return len(np.unique(red << 16 | green << 8 | blue))
