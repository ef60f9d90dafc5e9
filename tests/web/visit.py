"""One browser context before one server, and the rules that the page keeps to throughout."""

from __future__ import annotations

import re
from typing import Any, Self
from urllib.parse import urlsplit

from playwright.sync_api import Browser, ConsoleMessage, Page, expect

# Machines of continuous integration have little to spare.
TIMEOUT_MS = 30_000
expect.set_options(timeout=TIMEOUT_MS)


class Visit:
    """A visit fails, when it ends, if the page asked another host for something, broke its content
    security policy, threw, or logged an error.

    allowed: pattern of errors in the console that the test provokes.
    """

    def __init__(self, browser: Browser, url: str, *, allowed: str = "$^", **options: Any) -> None:
        self.url = url
        self.requested: list[str] = []
        self.errors: list[str] = []
        self._allowed = re.compile(allowed)
        values = {"viewport": {"width": 1280, "height": 800}, "reduced_motion": "reduce"}
        self._context = browser.new_context(base_url=url, **(values | options))
        self._context.set_default_timeout(TIMEOUT_MS)
        self.page: Page = self._context.new_page()
        self.page.on("request", lambda request: self.requested.append(request.url))
        self.page.on("console", self._logged)
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.received_by_url: dict[str, int] = {}
        self._count_bytes()

    def go(self, path: str) -> Page:
        self.page.goto(path)
        return self.page

    def foreign_requests(self) -> list[str]:
        """Those for which another host would be asked."""
        own = urlsplit(self.url).netloc
        return [
            url
            for url in self.requested
            if urlsplit(url).scheme not in ("data", "blob") and urlsplit(url).netloc != own
        ]

    def received(self, *, without: str | None = None) -> int:
        """Bytes of bodies so far, compressed as they came; without those of some addresses."""
        return sum(
            count
            for url, count in self.received_by_url.items()
            if without is None or without not in url
        )

    def close(self) -> None:
        self._context.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self.close()
        if kind is None:
            assert not self.foreign_requests(), self.foreign_requests()
            assert not self.errors, self.errors

    def _count_bytes(self) -> None:
        urls: dict[str, str] = {}
        network = self._context.new_cdp_session(self.page)
        network.send("Network.enable")
        network.on(
            "Network.requestWillBeSent",
            lambda event: urls.update({event["requestId"]: event["request"]["url"]}),
        )

        def came(event: dict[str, Any]) -> None:
            url = urls[event["requestId"]]
            before = self.received_by_url.get(url, 0)
            self.received_by_url[url] = before + event["encodedDataLength"]

        network.on("Network.dataReceived", came)

    def _logged(self, message: ConsoleMessage) -> None:
        if message.type == "error" and not self._allowed.search(message.text):
            self.errors.append(f"{message.text} ({message.location.get('url')})")
