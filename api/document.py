"""`python -m gaitswarm.api.document`: the OpenAPI document as JSON, for the types of the page"""

from __future__ import annotations

import json
import sys
from typing import cast

from gaitswarm.api.app import create_app
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.settings import Settings


def document() -> str:
    """Return the document of /openapi.json, one field per line."""
    # No route is called, so no service is needed; settings of the environment are ignored.
    app = create_app(cast(JobService, None), settings=Settings.model_construct())
    return json.dumps(app.openapi(), indent=1, ensure_ascii=False)


if __name__ == "__main__":
    sys.stdout.write(f"{document()}\n")
