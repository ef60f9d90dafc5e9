"""Responses that are serialized once, binary, or cached by clients."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import Final

from fastapi import Response, status
from pydantic import BaseModel

from gaitswarm.services.optimizer.views import MEDIA_TYPE

NOT_STORED: Final = {"Cache-Control": "no-store"}


class BinaryResponse(Response):
    """Bytes, documented as such."""

    media_type = MEDIA_TYPE


def json_response(view: BaseModel, headers: Mapping[str, str] | None = None) -> Response:
    """Serialize a view without FastAPI's second validation."""
    body = view.model_dump_json(by_alias=True)
    return Response(body, headers=headers, media_type="application/json")


def tagged_response(
    content: bytes, media_type: str, received: str | None, headers: Mapping[str, str]
) -> Response:
    """Return content with its ETag, or 304 if `received`, the If-None-Match header, has it."""
    tag = {"ETag": f'"{hashlib.sha256(content).hexdigest()}"'}
    if received is not None and tag["ETag"] in received:
        return Response(status_code=status.HTTP_304_NOT_MODIFIED, headers={**headers, **tag})
    return Response(content, media_type=media_type, headers={**headers, **tag})
