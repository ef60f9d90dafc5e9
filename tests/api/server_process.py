"""A server of the store whose URL is its argument, in a process of its own."""

from __future__ import annotations

import sys

from gaitswarm.api.app import create_app
from gaitswarm.api.server import ApiServer
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store import open_store
from gaitswarm.settings import Settings


def main() -> None:
    """Print where it listens, and serve until a signal comes."""
    store = open_store(sys.argv[1])
    settings = Settings(api_port=0, api_event_poll_seconds=60.0, api_shutdown_seconds=60)
    app = create_app(JobService(store), settings=settings)
    server = ApiServer(app, settings)
    sys.stdout.write(f"{server.url}\n")
    server.run()
    store.close()
    sys.stdout.write("closed\n")
