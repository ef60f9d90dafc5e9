"""/docs: the OpenAPI document to read and to try, without any other host."""

from __future__ import annotations

import base64
import hashlib
import re
from typing import Final

from fastapi import FastAPI, Request, Response
from fastapi.openapi.docs import get_swagger_ui_html

from api.security import policy

ASSETS: Final = "/docs-assets"

_INLINE_SCRIPT: Final = re.compile(rb"<script>(.*?)</script>", re.DOTALL)


def add_documentation(app: FastAPI) -> None:
    """Serve /docs.

    Its scripts lie under ASSETS. The inline one that starts them is allowed by its hash; it writes
    styles into the page, which has no content of users.
    """

    def documentation(request: Request) -> Response:
        root = request.scope.get("root_path", "")
        page = get_swagger_ui_html(
            openapi_url=f"{root}{app.openapi_url}",
            title=f"{app.title}: the API",
            swagger_js_url=f"{root}{ASSETS}/swagger-ui-bundle.js",
            swagger_css_url=f"{root}{ASSETS}/swagger-ui.css",
            swagger_favicon_url=f"{root}{ASSETS}/favicon.png",
        )
        hashes = [
            f"'sha256-{base64.b64encode(hashlib.sha256(script).digest()).decode()}'"
            for script in _INLINE_SCRIPT.findall(bytes(page.body))
        ]
        page.headers["Content-Security-Policy"] = policy(
            script_src=" ".join(["'self'", *hashes]), style_src="'self' 'unsafe-inline'"
        )
        return page

    app.add_route("/docs", documentation, include_in_schema=False)
