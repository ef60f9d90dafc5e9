"""Binary answers of the API, read as docs/api.md says."""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray


def unframed(content: bytes) -> tuple[dict[str, Any], NDArray[np.float32]]:
    """The header in JSON, and all numbers behind it."""
    (length,) = struct.unpack_from("<I", content)
    assert length % 4 == 0
    header = json.loads(content[4 : 4 + length])
    return header, np.frombuffer(content, dtype="<f4", offset=4 + length)
