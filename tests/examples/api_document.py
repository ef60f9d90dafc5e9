"""The server's OpenAPI document, made once for all tests of a process: it takes seconds."""

from __future__ import annotations

import copy
import json
from functools import cache
from typing import Any

from gaitswarm.api.document import document


def api_document() -> dict[str, Any]:
    """A copy of it, of a server with the usual settings."""
    return copy.deepcopy(_document())


@cache
def _document() -> dict[str, Any]:
    return json.loads(document())
