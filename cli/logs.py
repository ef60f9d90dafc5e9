"""Logs of long-running processes on standard error, as text or JSON."""

from __future__ import annotations

import json
import logging
import sys
from datetime import UTC, datetime
from typing import Any, Literal

LogFormat = Literal["console", "json"]


class JsonFormatter(logging.Formatter):
    """One line of JSON per message: time, level, logger, message.

    If they apply, also `job`, `iteration`, `request` and `traceback`.
    """

    def format(self, record: logging.LogRecord) -> str:
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
    handler = logging.StreamHandler(sys.stderr)
    if log_format == "json":
        handler.setFormatter(JsonFormatter())
        logging.captureWarnings(capture=True)
    else:
        handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
    logging.basicConfig(level=level, handlers=[handler])
    # It would report migrations at every start.
    logging.getLogger("alembic").setLevel(logging.WARNING)
    # It logs complete URLs of webhooks, which may contain secrets.
    logging.getLogger("httpx2").setLevel(logging.WARNING)
