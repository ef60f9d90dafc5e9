"""Screenshots of the main views for the documentation: `make pictures`.

With GAITSWARM_SCREENSHOTS, they show the thesis's job of chapter 4 and are saved to that folder;
otherwise they show a small job and are saved to a temporary folder.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import Locator, Page, expect

from tests.examples.servers import ServerProcess
from tests.web.conftest import SCREENSHOTS
from tests.web.pixels import colours
from tests.web.views import open_view
from tests.web.visit import Visit

pytestmark = pytest.mark.slow

LARGEST_BYTES = 300_000


@pytest.fixture(scope="session")
def shown_job(server: ServerProcess, finished_job: str) -> str:
    if not SCREENSHOTS:
        return finished_job
    job_id = server.submit({"name": "chapter 4, preference A", "seed": 1})
    server.wait_for(job_id, "succeeded", seconds=600.0)
    return job_id


@pytest.mark.thorough("pictures of the manual")
@pytest.mark.timeout(900)
@pytest.mark.parametrize(
    ("name", "scheme"),
    [("job", "light"), ("what-if", "light"), ("two-walks", "dark"), ("controller", "light")],
)
def test_pictures(
    server: ServerProcess,
    shown_job: str,
    visit: Callable[..., Visit],
    tmp_path: Path,
    name: str,
    scheme: str,
) -> None:
    window = {"width": 1120, "height": 760}
    page = open_view(visit(server.url, color_scheme=scheme, viewport=window), name, shown_job)
    part: Page | Locator = page
    if name == "what-if":
        page.get_by_role("button", name="C", exact=True).click()
        # Under the job's preference, the correlation would be 1.
        expect(page.get_by_text("rank correlation")).not_to_contain_text("preference: 1.00")
    if name == "two-walks":
        page.get_by_role("button", name="Side by side").click()
        page.get_by_label("Time in the walk").fill("80")
        part = page.locator("[data-player]")
        expect(part).to_have_attribute("data-frame", "80")

    file = (Path(SCREENSHOTS) if SCREENSHOTS else tmp_path) / f"page-{name}.png"
    part.screenshot(path=file, animations="disabled")

    assert file.stat().st_size < LARGEST_BYTES
    from matplotlib.image import imread

    image = imread(file)[..., :3]
    assert colours((image * 255).astype("uint8")) > 100
    assert (image.mean() > 0.5) == (scheme == "light")
