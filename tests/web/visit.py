"""One page before one server, and the rules that it keeps to throughout."""

from __future__ import annotations

import re
from typing import Any, Final, Literal, Self
from urllib.parse import urlsplit

from playwright.sync_api import ConsoleMessage, Error, Page, Request, ViewportSize, expect

from tests.web.pages import TIMEOUT_MS, Pages

expect.set_options(timeout=TIMEOUT_MS)

WINDOW: Final[ViewportSize] = {"width": 1280, "height": 800}


def seen_again(page: Page) -> None:
    """As when the tab is shown again: what is asked now and then is asked at once."""
    page.evaluate("document.dispatchEvent(new Event('visibilitychange'))")


class Visit:
    """A visit fails, when it ends, if the page asked another host for something, broke its content
    security policy, threw, or logged an error.

    allowed: pattern of errors in the console that the test provokes. color_scheme: that the system
    is set to. bypass_csp: of a page that a test adds its own scripts to. fresh: nothing is cached
    yet, and what comes is counted.
    """

    def __init__(
        self,
        pages: Pages,
        url: str,
        *,
        allowed: str = "$^",
        viewport: ViewportSize = WINDOW,
        color_scheme: Literal["light", "dark"] = "light",
        bypass_csp: bool = False,
        fresh: bool = False,
    ) -> None:
        self.url = url
        self.requested: list[str] = []
        self.errors: list[str] = []
        self.received_by_url: dict[str, int] = {}
        self._allowed = re.compile(allowed)
        self._pages = pages
        self.page: Page = pages.take(url, bypass_csp=bypass_csp, fresh=fresh)
        self.page.set_viewport_size(viewport)
        self.page.emulate_media(color_scheme=color_scheme)
        self.page.on("request", self._asked)
        self.page.on("console", self._logged)
        self.page.on("pageerror", self._threw)
        if fresh:
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
        """Bytes of bodies so far, compressed as they came; without those of some addresses. Of a
        fresh visit."""
        return sum(
            count
            for url, count in self.received_by_url.items()
            if without is None or without not in url
        )

    def close(self, *, failed: bool = False) -> None:
        self.page.remove_listener("request", self._asked)
        self.page.remove_listener("console", self._logged)
        self.page.remove_listener("pageerror", self._threw)
        self._pages.give_back(self.page, failed=failed)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self.close(failed=kind is not None)
        if kind is None:
            assert not self.foreign_requests(), self.foreign_requests()
            assert not self.errors, self.errors

    def _count_bytes(self) -> None:
        urls: dict[str, str] = {}
        network = self.page.context.new_cdp_session(self.page)
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

    def _asked(self, request: Request) -> None:
        self.requested.append(request.url)

    def _threw(self, error: Error) -> None:
        self.errors.append(str(error))

    def _logged(self, message: ConsoleMessage) -> None:
        if message.type == "error" and not self._allowed.search(message.text):
            self.errors.append(f"{message.text} ({message.location.get('url')})")
