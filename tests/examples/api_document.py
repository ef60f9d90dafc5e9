"""The OpenAPI document, made once for all tests of a process, as it takes seconds.

It is made where a setting of the environment is wrong: no server, database or setting is needed.
"""

from __future__ import annotations

import copy
import json
import os
from functools import cache
from typing import Any
from unittest.mock import patch

from gaitswarm.api.document import document


def api_document() -> dict[str, Any]:
    """A copy of it, of a server with the usual settings."""
    return copy.deepcopy(_document())


@cache
def _document() -> dict[str, Any]:
    with patch.dict(os.environ, {"GAITSWARM_API_PORT": "none"}):
        return dict(json.loads(document()))
