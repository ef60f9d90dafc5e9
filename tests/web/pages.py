"""Pages of one browser that visits take and give back: a new one costs more than most visits."""

from __future__ import annotations

from collections import defaultdict
from typing import Final

from playwright.sync_api import Browser, BrowserContext, Error, Page

# Machines of continuous integration have little to spare.
TIMEOUT_MS: Final = 30_000

FORGET = "() => { localStorage.clear(); sessionStorage.clear() }"

Kind = tuple[str, bool]
"""What a context is made for: a server's address, and whether its content policy is bypassed."""


class Pages:
    """Hands out pages that know nothing of the visits before, save the cached files of the page.

    A page of a new context is drawn by a new process, which takes five times what it takes to load
    another view in one that runs.
    """

    def __init__(self, browser: Browser) -> None:
        self._browser = browser
        self._idle: dict[Kind, list[Page]] = defaultdict(list)
        self._kinds: dict[Page, Kind] = {}

    def take(self, url: str, *, bypass_csp: bool = False, fresh: bool = False) -> Page:
        """A blank page. fresh: with nothing in its cache, and closed when it is given back."""
        kind = (url, bypass_csp)
        if self._idle[kind] and not fresh:
            return self._idle[kind].pop()
        context = self._new_context(url, bypass_csp=bypass_csp)
        page = context.new_page()
        if not fresh:
            self._kinds[page] = kind
        return page

    def give_back(self, page: Page, *, failed: bool = False) -> None:
        """failed: the page is in no known state and is closed."""
        kind = self._kinds.get(page)
        if kind is None or failed or not _forgets(page):
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


def _forgets(page: Page) -> bool:
    """Whether a page could be emptied of all that its visit has left."""
    try:
        page.unroute_all(behavior="ignoreErrors")
        for other in page.context.pages:
            if other is not page:
                other.close()
        page.evaluate(FORGET)
        page.context.clear_cookies()
        page.goto("about:blank")
        page.mouse.move(0, 0)
    except Error:
        return False
    return True
