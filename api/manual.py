"""The manual, as `make manual` builds it from docs/, under /manual."""

from __future__ import annotations

from html import escape
from http import HTTPStatus
from pathlib import Path
from typing import Annotated, Final

from fastapi import Depends, FastAPI, Request, Response
from starlette.responses import FileResponse, HTMLResponse, RedirectResponse

from gaitswarm.api.documentation import policy_of
from gaitswarm.api.problems import problem

FOLDER: Final = Path(__file__).parent / "manual"
"""`make manual` builds it; wheels of `make wheel` and the image bring it."""

_FIRST: Final = "docs/index.html"

_UNBUILT: Final = (
    "this server has no manual; `make manual` builds it in a checkout of gaitswarm, where"
    " docs/index.md leads to the same pages as Markdown"
)

_UNBUILT_PAGE: Final = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>gaitswarm: no manual</title>
<h1>This server has no manual</h1>
<p>In a checkout of gaitswarm, <code>make manual</code> builds it. The server that runs from the
checkout has it from then on, without a restart. Wheels of <code>make wheel</code> and the image
bring it.</p>
<p>The same pages are there as Markdown: begin with <code>docs/index.md</code> of the checkout.</p>
<p><a href="{root}/docs">The API explains itself</a> on every server.</p>
</html>
"""


def add_manual(app: FastAPI, folder: Path) -> None:
    """Serve a built manual; nothing of it is read before it is asked for."""
    app.state.manual_folder = folder

    def first(request: Request) -> Response:
        if not _is_built(folder):
            return _unbuilt(request)
        root = request.scope.get("root_path", "")
        return RedirectResponse(f"{root}/manual/{_FIRST}")

    def page(request: Request) -> Response:
        if not _is_built(folder):
            return _unbuilt(request)
        root = folder.resolve()
        path = (root / request.path_params["path"]).resolve()
        if not (path.is_relative_to(root) and path.is_file()):
            detail = "the manual has no such page; begin at /manual"
            return problem(request.url.path, "not-found", detail)
        if path.suffix != ".html":
            return FileResponse(path, headers={"Cache-Control": "no-cache"})
        text = path.read_bytes()
        policy = {"Content-Security-Policy": policy_of(text), "Cache-Control": "no-cache"}
        return HTMLResponse(text, headers=policy)

    app.add_route("/manual", first, include_in_schema=False)
    app.add_route("/manual/", first, include_in_schema=False)
    app.add_route("/manual/{path:path}", page, include_in_schema=False)


def _unbuilt(request: Request) -> Response:
    """What to do about it: a page for browsers, a problem for programs."""
    headers = {"Cache-Control": "no-cache", "Vary": "Accept"}
    if "text/html" not in request.headers.get("accept", ""):
        return problem(request.url.path, "not-found", _UNBUILT, headers=headers)
    text = _UNBUILT_PAGE.format(root=escape(request.scope.get("root_path", "")))
    return HTMLResponse(text, HTTPStatus.NOT_FOUND, headers)


def _is_built(folder: Path) -> bool:
    return (folder / _FIRST).is_file()


async def _has_manual(request: Request) -> bool:
    return _is_built(request.app.state.manual_folder)


HasManual = Annotated[bool, Depends(_has_manual)]
"""Whether this server has a built manual at /manual."""
