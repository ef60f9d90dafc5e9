"""Files that the page makes: numbers and pictures of charts."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from playwright.sync_api import Locator, Page, expect

from tests.examples.servers import ServerProcess
from tests.web.visit import Visit

pytestmark = pytest.mark.slow

SVG = "{http://www.w3.org/2000/svg}"


def save(page: Page, chart: str, entry: str, folder: Path) -> Path:
    """The file that an entry of a chart's menu makes, under the name that is proposed for it."""
    button = page.get_by_role("button", name=re.compile(f"^Save .*: {chart}$"))
    button.click()
    expect(page.get_by_role("menuitem").first).to_be_focused()
    with page.expect_download() as download:
        page.get_by_role("menuitem", name=entry).click()
    target = folder / download.value.suggested_filename
    download.value.save_as(target)
    return target


def opaque(canvas: Locator, x: float, y: float) -> bool:
    """Whether something stronger than a grid's line is painted at a place [px]."""
    taken = "(c, [x, y]) => [...c.getContext('2d').getImageData(x, y, 1, 1).data]"
    red, green, blue, alpha = canvas.evaluate(taken, [x, y])
    return bool(alpha > 200 and max(red, green, blue) < 160)


def test_a_chart_gives_its_numbers_in_full_and_its_picture(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit], tmp_path: Path
) -> None:
    page = visit(server.url).go(f"/jobs/{finished_job}?dots=yes")
    expect(page.locator("[data-dots]")).to_be_visible()
    # All six iterations, also where they are there before the chart is.
    expect(page.locator(".uplot").first).to_have_attribute("data-range", "0 5")
    numbers = save(page, "Convergence", "Numbers (CSV)", tmp_path)
    assert numbers.name == "small-convergence.csv"
    with numbers.open(newline="") as file:
        rows = list(csv.DictReader(file))
    told = server.client.get(f"/v1/jobs/{finished_job}/iterations").json()["items"]
    assert [float(row["Best so far"]) for row in rows] == [one["best_so_far"] for one in told]

    saved = save(page, "Convergence", "Picture (SVG)", tmp_path)
    drawing = ET.parse(saved).getroot()  # noqa: S314 - this page's own
    words = [text.text for text in drawing.iter(f"{SVG}text")]
    assert {"Convergence", "best so far", "iteration"} <= set(words)
    # Lines rather than pixels: the best so far has a place for every iteration.
    lines = [path.get("d", "") for path in drawing.iter(f"{SVG}path")]
    assert any(len(re.findall("[ML]", line)) == len(told) for line in lines)
    # What is over the lines on the screen is over them here: words, and marks of what lies above.
    best, published = told[-1]["best_so_far"], server.job(finished_job)["reference"]["fitness"]
    assert {f"best {best:#.4g}", f"published A {published:#.4g}"} <= set(words)
    places = re.compile(r"M(\S+) (\S+)L(\S+) (\S+)L\S+ (\S+)Z")
    marks = [
        [float(at) for at in found.groups()] for found in map(places.fullmatch, lines) if found
    ]
    assert len(marks) == int(page.locator("[data-above]").get_attribute("data-above") or 0) > 0
    # They point up, as in the legend.
    assert all(tip < foot == other for _, foot, _, other, tip in marks)
    assert "▴ worse designs lie above what is shown" in words
    # And they are where they are on the screen, to the pixel.
    canvas = page.locator(".uplot canvas").first
    for left, foot, right, _, tip in marks:
        assert opaque(canvas, (left + right) / 2, (2 * foot + tip) / 3)
    [dashed] = [line for line in drawing.iter(f"{SVG}path") if line.get("stroke-dasharray")]
    left, y, right, _ = map(float, re.findall(r"[-\d.]+", dashed.get("d", "")))
    along = [opaque(canvas, left + (right - left) * step / 60, y) for step in range(1, 60)]
    assert 20 < sum(along) < 60
    assert not list(drawing.iter(f"{SVG}image"))

    picture = save(page, "Convergence", "Picture (PNG)", tmp_path).read_bytes()
    assert picture.startswith(b"\x89PNG")
    assert int.from_bytes(picture[16:20]) == 2 * int(drawing.get("width", "0"))


def test_every_design_is_in_the_file_of_parallel_coordinates(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit], tmp_path: Path
) -> None:
    page = visit(server.url).go(f"/jobs/{finished_job}/variables")
    with save(page, "Designs by their variables", "Numbers (CSV)", tmp_path).open(
        newline=""
    ) as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 48
    best = min(float(row["fitness"]) for row in rows if row["fitness"])
    told = server.client.get(f"/v1/jobs/{finished_job}").json()["best"]["fitness"]
    assert best == pytest.approx(told, rel=1e-6)
    page.keyboard.press("Escape")
    expect(page.get_by_role("menu")).to_have_count(0)


def test_what_limits_the_winner_is_saved_with_the_names_of_its_columns(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit], tmp_path: Path
) -> None:
    page = visit(server.url).go(f"/jobs/{finished_job}")
    card = page.get_by_role("region", name="What limits the winner", exact=True)
    saved = save(page, "What limits the winner", "Picture (SVG)", tmp_path)
    drawing = ET.parse(saved).getroot()  # noqa: S314 - this page's own
    drawn = " ".join(text.text or "" for text in drawing.iter(f"{SVG}text"))
    names = card.locator("thead th").all_inner_texts()
    assert len(names) > 3
    assert all(" ".join(name.split()) in drawn for name in names)

    file = save(page, "What limits the winner", "Numbers (CSV)", tmp_path)
    with file.open(newline="") as numbers:
        rows = list(csv.DictReader(numbers))
    told = server.client.get(f"/v1/jobs/{finished_job}").json()["best"]["scenarios"]
    values = {(row["Scenario"], row["Objective"]): float(row["Value"]) for row in rows}
    assert {scenario for scenario, _ in values} == set(told)
    for (scenario, objective), value in values.items():
        assert value == told[scenario]["objectives"][objective.replace(" ", "_")]
