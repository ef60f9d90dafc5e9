"""Pool of browser pages, since creating a page costs more than most visits."""

from __future__ import annotations

from collections import defaultdict
from typing import Final

from playwright.sync_api import Browser, BrowserContext, Error, Page

# Machines of continuous integration are slow.
TIMEOUT_MS: Final = 30_000

CLEAR_STORAGE = "() => { localStorage.clear(); sessionStorage.clear() }"

Kind = tuple[str, bool]
"""Key of a context: server address, and whether the content security policy is bypassed."""


class Pages:
    """Pages without state from previous visits except cached files.

    A new context starts a renderer process, which takes five times as long as loading another view.
    """

    def __init__(self, browser: Browser) -> None:
        self._browser = browser
        self._idle: dict[Kind, list[Page]] = defaultdict(list)
        self._kinds: dict[Page, Kind] = {}

    def take(self, url: str, *, bypass_csp: bool = False, fresh: bool = False) -> Page:
        """Get a blank page. fresh: with an empty cache; closed when given back."""
        kind = (url, bypass_csp)
        if self._idle[kind] and not fresh:
            return self._idle[kind].pop()
        context = self._new_context(url, bypass_csp=bypass_csp)
        page = context.new_page()
        if not fresh:
            self._kinds[page] = kind
        return page

    def give_back(self, page: Page, *, failed: bool = False) -> None:
        """failed: the state of the page is unknown, so it is closed."""
        kind = self._kinds.get(page)
        if kind is None or failed or not _reset(page):
            self._kinds.pop(page, None)
            page.context.close()
        else:
            self._idle[kind].append(page)

    def _new_context(self, url: str, *, bypass_csp: bool) -> BrowserContext:
        context = self._browser.new_context(
            base_url=url, bypass_csp=bypass_csp, reduced_motion="reduce"
        )
        context.set_default_timeout(TIMEOUT_MS)
        return context


def _reset(page: Page) -> bool:
    """Reset a page; returns whether that succeeded."""
    try:
        page.unroute_all(behavior="ignoreErrors")
        for other in page.context.pages:
            if other is not page:
                other.close()
        page.evaluate(CLEAR_STORAGE)
        page.context.clear_cookies()
        page.goto("about:blank")
        page.mouse.move(0, 0)
    except Error:
        return False
    return True
