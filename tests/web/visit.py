"""A visit to the page, with checks that hold throughout."""

from __future__ import annotations

import re
from typing import Any, Final, Literal, Self
from urllib.parse import urlsplit

from playwright.sync_api import ConsoleMessage, Error, Page, Request, ViewportSize, expect

from tests.web.pages import TIMEOUT_MS, Pages

expect.set_options(timeout=TIMEOUT_MS)

WINDOW: Final[ViewportSize] = {"width": 1280, "height": 800}


def show_tab_again(page: Page) -> None:
    """Simulate a tab becoming visible, which triggers polling at once."""
    page.evaluate("document.dispatchEvent(new Event('visibilitychange'))")


class Visit:
    """Fails at its end if the page sent requests to another host, violated its content security
    policy, threw, or logged an error.

    allowed: pattern of expected console errors. color_scheme: of the system. bypass_csp:
    for tests that inject scripts. fresh: empty cache, with received bytes counted.
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
        self.page.on("request", self._requested)
        self.page.on("console", self._logged)
        self.page.on("pageerror", self._threw)
        if fresh:
            self._count_bytes()

    def go(self, path: str) -> Page:
        self.page.goto(path)
        return self.page

    def foreign_requests(self) -> list[str]:
        """Requests to other hosts."""
        host = urlsplit(self.url).netloc
        return [
            url
            for url in self.requested
            if urlsplit(url).scheme not in ("data", "blob") and urlsplit(url).netloc != host
        ]

    def received(self, *, without: str | None = None) -> int:
        """Compressed bytes of bodies received by a fresh visit; `without` excludes addresses."""
        return sum(
            count
            for url, count in self.received_by_url.items()
            if without is None or without not in url
        )

    def close(self, *, failed: bool = False) -> None:
        self.page.remove_listener("request", self._requested)
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

        def received(event: dict[str, Any]) -> None:
            url = urls[event["requestId"]]
            before = self.received_by_url.get(url, 0)
            self.received_by_url[url] = before + event["encodedDataLength"]

        network.on("Network.dataReceived", received)

    def _requested(self, request: Request) -> None:
        self.requested.append(request.url)

    def _threw(self, error: Error) -> None:
        self.errors.append(str(error))

    def _logged(self, message: ConsoleMessage) -> None:
        if message.type == "error" and not self._allowed.search(message.text):
            self.errors.append(f"{message.text} ({message.location.get('url')})")
