"""What a picture of the page shows, as far as numbers can say."""

from __future__ import annotations

from io import BytesIO

import matplotlib.image
import numpy as np
from numpy.typing import NDArray
from playwright.sync_api import Locator


def pixels(element: Locator) -> NDArray[np.uint8]:
    """An element as it is painted: (height, width, 3)."""
    image = matplotlib.image.imread(BytesIO(element.screenshot()), format="png")
    return np.round(image[..., :3] * 255).astype(np.uint8)


def colours(image: NDArray[np.uint8]) -> int:
    """How many colours there are; a blank picture has a handful."""
    return len(np.unique(image.reshape(-1, 3), axis=0))
