"""The web page and the manual: static files, read on request, also if they are built later."""

from __future__ import annotations

import mimetypes
import re
from http import HTTPStatus
from pathlib import Path
from typing import Annotated, Final

from fastapi import Depends, FastAPI, Request, Response
from starlette.responses import FileResponse, HTMLResponse, RedirectResponse
from starlette.types import Receive, Scope, Send

from gaitswarm.api.documentation import policy_of
from gaitswarm.api.problems import problem
from gaitswarm.views.base import PREFIX

PAGE_FOLDER: Final = Path(__file__).parent / "page"
"""Built by `make page` from web/; part of wheels."""

MANUAL_FOLDER: Final = Path(__file__).parent / "manual"
"""Built by `make manual` from docs/; part of wheels and of the image."""

PAGES: Final = ("/jobs", "/compare", "/walk", "/controller")
"""Paths of the page's views, each with all paths below it."""

_JOB_PAGE: Final = re.compile(r"/jobs/[a-z0-9]{12}")

_NO_PAGE: Final = "the page is not built; run `make page`, or see /docs for the API"

# Browsers load no module script of another type; the machine's own table may lack these.
_MEDIA_TYPES: Final = {".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml"}

_NO_CACHE: Final = {"Cache-Control": "no-cache"}

_MANUAL_INDEX: Final = "docs/index.html"

_NO_MANUAL: Final = (
    "this server has no manual; run `make manual` in a checkout of gaitswarm, or read"
    " docs/index.md there"
)


def is_built(folder: Path = PAGE_FOLDER) -> bool:
    return (folder / "index.html").is_file()


def add_page(app: FastAPI, folder: Path) -> None:
    """Serve the page. If it is not built, redirect `/` to /docs and a job's page to its JSON."""

    def page(request: Request) -> Response:
        try:
            text = (folder / "index.html").read_text(encoding="utf-8")
        except FileNotFoundError:
            root = request.scope.get("root_path", "")
            path = request.url.path.removeprefix(root)
            if path == "/":
                return RedirectResponse(f"{root}/docs")
            if _JOB_PAGE.fullmatch(path):
                return RedirectResponse(f"{root}{PREFIX}{path}")
            return problem(request.url.path, "not-found", _NO_PAGE)
        # It names assets that a newer build no longer has.
        return HTMLResponse(text, headers=_NO_CACHE)

    def asset(request: Request) -> Response:
        path = _file(folder / "assets", request.path_params["name"])
        if path is None or path.name.startswith("."):
            detail = "the page has no such asset; reload the page, it has been rebuilt"
            return problem(request.url.path, "not-found", detail)
        media_type = _MEDIA_TYPES.get(path.suffix) or mimetypes.guess_type(path.name)[0]
        headers = {"Cache-Control": "public, max-age=31536000, immutable"}
        return FileResponse(path, headers=headers, media_type=media_type)

    for path in ("/", *PAGES, *(f"{view}/{{rest:path}}" for view in PAGES)):
        app.add_route(path, page, include_in_schema=False)
    app.add_route("/assets/{name}", asset, include_in_schema=False)
    not_found = app.router.default

    async def default(scope: Scope, receive: Receive, send: Send) -> None:
        request = Request(scope)
        if request.headers.get("Accept", "").startswith("text/html") and is_built(folder):
            # The page says that there is no such view.
            response = page(request)
            response.status_code = HTTPStatus.NOT_FOUND
            await response(scope, receive, send)
        else:
            await not_found(scope, receive, send)

    app.router.default = default


def _file(folder: Path, name: str) -> Path | None:
    """Return a file in a folder or below it; None if there is none of that name."""
    root = folder.resolve()
    try:
        path = (root / name).resolve()
        return path if path.is_relative_to(root) and path.is_file() else None
    except (OSError, ValueError):
        # A name that no file can have, too long or with a null byte.
        return None


def add_manual(app: FastAPI, folder: Path) -> None:
    app.state.manual_folder = folder

    def page(request: Request) -> Response:
        name = request.path_params.get("path", "")
        if not _has_manual(folder):
            return problem(request.url.path, "not-found", _NO_MANUAL)
        if not name:
            base = request.scope.get("root_path", "")
            return RedirectResponse(f"{base}/manual/{_MANUAL_INDEX}")
        path = _file(folder, name)
        if path is None:
            detail = "the manual has no such page; begin at /manual"
            return problem(request.url.path, "not-found", detail)
        if path.suffix != ".html":
            return FileResponse(path, headers=_NO_CACHE)
        text = path.read_bytes()
        return HTMLResponse(text, headers={"Content-Security-Policy": policy_of(text), **_NO_CACHE})

    app.add_route("/manual", page, include_in_schema=False)
    app.add_route("/manual/{path:path}", page, include_in_schema=False)


def _has_manual(folder: Path) -> bool:
    return (folder / _MANUAL_INDEX).is_file()


async def _serves_manual(request: Request) -> bool:
    return _has_manual(request.app.state.manual_folder)


HasManual = Annotated[bool, Depends(_serves_manual)]
"""Whether this server has a built manual."""
