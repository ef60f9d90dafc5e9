"""`python -m gaitswarm.api.document`: the OpenAPI document as JSON on stdout.

It needs neither a server nor a database; the page's types are made from it.
"""

from __future__ import annotations

import json
import sys
from typing import cast

from gaitswarm.api.app import create_app
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.settings import Settings


def document() -> str:
    """The document that /openapi.json answers, one field a line."""
    # No route is called, so none misses the service; nor do settings of the environment matter.
    app = create_app(cast(JobService, None), settings=Settings.model_construct())
    return json.dumps(app.openapi(), indent=1, ensure_ascii=False)


if __name__ == "__main__":
    sys.stdout.write(f"{document()}\n")
