"""State of a job's page, from its data attributes."""

from __future__ import annotations

import re

from playwright.sync_api import Locator, Page, expect

_REACHED = "index => Number(document.querySelector('[data-stream]')?.dataset.iteration) >= index"


def job_element(page: Page) -> Locator:
    return page.locator("[data-stream]")


def command(page: Page, name: str) -> Locator:
    """A command of the job's menu, which may be closed."""
    return page.locator(".actions [role=menuitem]").filter(has_text=re.compile(f"^{name}$"))


def choose(page: Page, name: str) -> None:
    """Choose a command of the job's menu."""
    page.get_by_role("button", name=re.compile("^Actions")).click()
    command(page, name).click()


def shown_iteration(page: Page) -> int:
    """Index of the last iteration shown; -1 before the first."""
    text = job_element(page).get_attribute("data-iteration")
    return int(text) if text else -1


def wait_for_iteration(page: Page, index: int) -> None:
    """Wait until this iteration or a later one is shown."""
    page.wait_for_function(_REACHED, arg=index)


def expect_state(page: Page, state: str) -> None:
    expect(page.get_by_role("status").get_by_text(state, exact=True)).to_be_visible()
