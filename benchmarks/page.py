"""Speed of the page on a large store, in the machine's own Chromium.

    python -m benchmarks.page [jobs.db] [--rounds 5] [--json]

The store is made if it is not there: a thousand jobs, one of them of 100 000 evaluations. Times are
from the request to the first rows or curves on the screen, without any cache; pictures a second are
what the browser could draw while it was scrolled or brushed. Headless Chromium draws in software.
"""

from __future__ import annotations

import argparse
import itertools
import json
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from playwright.sync_api import Page, sync_playwright

from benchmarks.large_store import fill
from gaitswarm.services.runtime import open_store
from tests.examples.servers import ServerProcess
from tests.web.chromium import ARGUMENTS, find_browser
from tests.web.pages import Pages
from tests.web.visit import Visit

_COUNT_PICTURES: Final = """() => {
    window.pictures = []
    const count = (now) => {
        window.pictures.push(now)
        window.counting = requestAnimationFrame(count)
    }
    window.counting = requestAnimationFrame(count)
}"""

_PICTURES: Final = "() => { cancelAnimationFrame(window.counting); return window.pictures }"


def first_view(pages: Pages, url: str, path: str, shown: str) -> dict[str, Any]:
    """One visit: seconds to what is looked for, bytes received until then."""
    with Visit(pages, url, fresh=True) as visit:
        begun = time.perf_counter()
        visit.page.goto(path, wait_until="commit")
        visit.page.locator(shown).first.wait_for()
        seconds = time.perf_counter() - begun
        return {"seconds": seconds, "kilobytes": visit.received(without="after=") / 1000}


def pictures(page: Page, move: Callable[[], None]) -> dict[str, float]:
    """Pictures a second while something moves, and the longest time between two [ms]."""
    page.evaluate(_COUNT_PICTURES)
    move()
    moments = page.evaluate(_PICTURES)
    gaps = [after - before for before, after in itertools.pairwise(moments)]
    return {
        "per_second": 1000.0 * len(gaps) / (moments[-1] - moments[0]),
        "longest_ms": max(gaps),
    }


def scroll(page: Page, steps: int) -> None:
    """Up and down, as a wheel does."""
    page.mouse.move(640, 400)
    for step in range(steps):
        page.mouse.wheel(0, 120 if step % 60 < 30 else -120)
        page.wait_for_timeout(16)


def brush(page: Page, steps: int) -> None:
    """Draw a stroke along an axis and lengthen it, bit by bit."""
    axis = page.locator(".axis").nth(1).bounding_box()
    assert axis is not None
    x, top = axis["x"] + axis["width"] / 2, axis["y"]
    page.mouse.move(x, top + 5)
    page.mouse.down()
    for step in range(steps):
        page.mouse.move(x, top + 5 + (axis["height"] - 10) * step / steps)
        page.wait_for_timeout(16)
    page.mouse.up()


def measure(pages: Pages, url: str, job: str, *, rounds: int, steps: int = 90) -> dict[str, Any]:
    """All numbers, from one browser.

    Args:
        pages: Of the browser.
        url: Of the server.
        job: Id of the one of 100 000 evaluations.
        rounds: First views, of which the median counts.
        steps: Of a wheel or a stroke, one a picture.

    Returns:
        By what was looked at: seconds and kilobytes of first views; pictures a second, and the
        longest time between two [ms], of what moves.
    """
    views = {
        "list of 1000 jobs": ("/", "[data-job]"),
        "job of 100 000 evaluations": (f"/jobs/{job}", "main canvas"),
    }
    found: dict[str, Any] = {}
    for name, (address, shown) in views.items():
        runs = [first_view(pages, url, address, shown) for _ in range(rounds)]
        found[name] = {
            key: statistics.median(run[key] for run in runs) for key in ("seconds", "kilobytes")
        }
    with Visit(pages, url, fresh=True) as visit:
        page = visit.go("/")
        page.locator("[data-job]").first.wait_for()
        found["scrolling the list"] = pictures(page, lambda: scroll(page, steps))
        page.goto(f"/jobs/{job}/iterations")
        page.locator('[data-iteration="3999"] table').wait_for()
        found["scrolling the iterations"] = pictures(page, lambda: scroll(page, steps))
        page.goto(f"/jobs/{job}/variables?designs=all")
        page.locator('canvas[data-rows="100000"]').wait_for()
        found["brushing 100 000 designs"] = pictures(page, lambda: brush(page, steps))
    return found


def main() -> None:
    """Make the store if need be, measure, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("path", nargs="?", type=Path)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        path = options.path or Path(folder) / "jobs.db"
        if not path.exists():
            store = open_store(str(path))
            fill(store)
            store.close()
        server = ServerProcess(path, "--no-runner")
        try:
            newest = server.client.get("/v1/jobs", params={"search": "long"}).json()["items"][0]
            with sync_playwright() as playwright:
                chromium = str(find_browser())
                browser = playwright.chromium.launch(executable_path=chromium, args=ARGUMENTS)
                found = measure(Pages(browser), server.url, newest["id"], rounds=options.rounds)
                browser.close()
        finally:
            server.close()
    if options.json:
        print(json.dumps(found, indent=2))
        return
    for name, numbers in found.items():
        print(f"{name:28}" + "".join(f"{value:10.2f} {key}" for key, value in numbers.items()))


if __name__ == "__main__":
    main()
