"""Logs of long-running processes on standard error: lines for people, or JSON for programs."""

from __future__ import annotations

import json
import logging
import sys
from datetime import UTC, datetime
from typing import Any, Literal

LogFormat = Literal["console", "json"]


class JsonFormatter(logging.Formatter):
    """A message as one line of JSON: time, level, logger, message, and what it belongs to.

    `job`, `iteration` and `request` are there where the message belongs to one. A bug has its
    `traceback`, as one string.
    """

    def format(self, record: logging.LogRecord) -> str:
        """Write a message down."""
        from gaitswarm.services.optimizer.log_context import log_fields

        document: dict[str, Any] = {
            "time": datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds"),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": record.getMessage(),
            **log_fields(),
        }
        if record.exc_info:
            document["traceback"] = self.formatException(record.exc_info)
        return json.dumps(document, ensure_ascii=False, default=str)


def log_to_stderr(level: str, log_format: LogFormat = "console") -> None:
    """Show what a long-running process logs."""
    handler = logging.StreamHandler(sys.stderr)
    if log_format == "json":
        handler.setFormatter(JsonFormatter())
        logging.captureWarnings(capture=True)
    else:
        handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
    logging.basicConfig(level=level, handlers=[handler])
    # Every start would tell of migrations that are already done.
    logging.getLogger("alembic").setLevel(logging.WARNING)
    # Its lines show URLs of webhooks in full, which may hold secrets.
    logging.getLogger("httpx2").setLevel(logging.WARNING)
