"""The server's OpenAPI document, made once for all tests of a process: it takes seconds."""

from __future__ import annotations

import copy
from functools import cache
from typing import Any, cast

from gaitswarm.api.app import create_app
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.settings import Settings


def api_document() -> dict[str, Any]:
    """A copy of it, of a server with the usual settings."""
    return copy.deepcopy(_document())


@cache
def _document() -> dict[str, Any]:
    return create_app(cast(JobService, None), settings=Settings()).openapi()
