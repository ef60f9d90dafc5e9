"""The manual, as `make manual` builds it from docs/, under /manual."""

from __future__ import annotations

from http import HTTPStatus
from pathlib import Path
from typing import Annotated, Final

from fastapi import Depends, FastAPI, Request, Response
from starlette.responses import FileResponse, HTMLResponse, RedirectResponse

from api.documentation import policy_of
from api.problems import problem

FOLDER: Final = Path(__file__).parent / "manual"
"""`make manual` builds it; a wheel brings it."""

_FIRST: Final = "docs/index.html"

_UNBUILT: Final = "the manual is not built; `make manual` builds it, and docs/ has its pages"


def add_manual(app: FastAPI, folder: Path) -> None:
    """Serve a built manual; nothing of it is read before it is asked for.

    Args:
        app: takes on the routes.
        folder: of the HTML that Sphinx made; there need be none.
    """
    app.state.manual_folder = folder

    def first(request: Request) -> Response:
        root = request.scope.get("root_path", "")
        return RedirectResponse(f"{root}/manual/{_FIRST}")

    def page(request: Request) -> Response:
        root = folder.resolve()
        path = (root / request.path_params["path"]).resolve()
        if not (path.is_relative_to(root) and path.is_file()):
            known = "the manual has no such page; begin at /manual"
            detail = known if _is_built(folder) else _UNBUILT
            return problem(request.url.path, HTTPStatus.NOT_FOUND, "not-found", detail)
        if path.suffix != ".html":
            return FileResponse(path, headers={"Cache-Control": "no-cache"})
        text = path.read_bytes()
        policy = {"Content-Security-Policy": policy_of(text), "Cache-Control": "no-cache"}
        return HTMLResponse(text, headers=policy)

    app.add_route("/manual", first, include_in_schema=False)
    app.add_route("/manual/", first, include_in_schema=False)
    app.add_route("/manual/{path:path}", page, include_in_schema=False)


def _is_built(folder: Path) -> bool:
    return (folder / _FIRST).is_file()


async def _has_manual(request: Request) -> bool:
    return _is_built(request.app.state.manual_folder)


HasManual = Annotated[bool, Depends(_has_manual)]
"""Whether this server has a built manual at /manual."""
