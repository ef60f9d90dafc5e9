"""Many numbers in one answer: a header in JSON, then float32."""

from __future__ import annotations

import struct
from typing import Final

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel

MEDIA_TYPE: Final = "application/octet-stream"


def framed(header: BaseModel, numbers: NDArray[np.floating]) -> bytes:
    """Length of the header (uint32), header (padded with spaces), numbers; all little-endian.

    The numbers begin at a multiple of four bytes, as typed arrays want them.
    """
    text = header.model_dump_json().encode()
    text += b" " * (-len(text) % 4)
    with np.errstate(over="ignore"):
        return struct.pack("<I", len(text)) + text + numbers.astype("<f4").tobytes()
