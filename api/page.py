"""The page for people: its HTML on the paths that it knows, and its assets.

Nothing of it is read before it is asked for, so a page that is built while the server runs is
served from then on.
"""

from __future__ import annotations

import mimetypes
import re
from pathlib import Path
from typing import Final

from fastapi import FastAPI, Request, Response
from starlette.responses import FileResponse, HTMLResponse, RedirectResponse

from gaitswarm.api.problems import problem
from gaitswarm.views import PREFIX

FOLDER: Final = Path(__file__).parent / "page"
"""`make page` builds it from web/; a wheel brings it."""

PAGES: Final = ("/jobs", "/compare", "/walk", "/controller")
"""With everything below them: the page itself tells its views apart by their paths."""

_JOB_PAGE: Final = re.compile(r"/jobs/([a-z0-9]{12})")

_UNBUILT: Final = "the page is not built; `make page` builds it, and /docs explains the API"

# Browsers load no module script of another type; the machine's own table may lack these.
_MEDIA_TYPES: Final = {".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml"}


def is_built(folder: Path = FOLDER) -> bool:
    """Whether there is a page to serve."""
    return (folder / "index.html").is_file()


def add_page(app: FastAPI, folder: Path) -> None:
    """Serve a built page; without one, `/` leads to /docs and a job's page to the job as JSON."""

    def page(request: Request) -> Response:
        try:
            text = (folder / "index.html").read_text(encoding="utf-8")
        except FileNotFoundError:
            instead = _without_page(request)
            if instead is not None:
                return RedirectResponse(instead)
            return problem(request.url.path, "not-found", _UNBUILT)
        # It names assets that a newer build no longer has: ask every time.
        return HTMLResponse(text, headers={"Cache-Control": "no-cache"})

    def asset(request: Request) -> Response:
        name = request.path_params["name"]
        path = folder / "assets" / name
        # The router gives no slash in a name; `..` remains.
        if name.startswith(".") or not path.is_file():
            detail = "the page has no such asset; reload the page, it was built anew"
            return problem(request.url.path, "not-found", detail)
        media_type = _MEDIA_TYPES.get(path.suffix) or mimetypes.guess_type(name)[0]
        headers = {"Cache-Control": "public, max-age=31536000, immutable"}
        return FileResponse(path, headers=headers, media_type=media_type)

    for path in ("/", *PAGES, *(f"{known}/{{rest:path}}" for known in PAGES)):
        app.add_route(path, page, include_in_schema=False)
    app.add_route("/assets/{name}", asset, include_in_schema=False)


def _without_page(request: Request) -> str | None:
    """Path of what the API itself has to show in place of a page that is not built, if anything."""
    root = request.scope.get("root_path", "")
    path = request.url.path.removeprefix(root)
    if path == "/":
        return f"{root}/docs"
    job = _JOB_PAGE.fullmatch(path)
    return f"{root}{PREFIX}/jobs/{job[1]}" if job else None
