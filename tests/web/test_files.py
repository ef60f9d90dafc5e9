"""Export of charts as numbers and pictures."""

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
    """Save a file with an entry of a chart's menu, under its suggested name."""
    button = page.get_by_role("button", name=re.compile(f"^Save .*: {chart}$"))
    button.click()
    expect(page.get_by_role("menuitem").first).to_be_focused()
    with page.expect_download() as download:
        page.get_by_role("menuitem", name=entry).click()
    target = folder / download.value.suggested_filename
    download.value.save_as(target)
    return target


READ_PIXELS = """(canvas, places) => {
    const context = canvas.getContext('2d')
    return places.map(([x, y]) => [...context.getImageData(x, y, 1, 1).data])
}"""


def opaque(canvas: Locator, places: list[tuple[float, float]]) -> list[bool]:
    """Whether something darker than a grid line is painted at each position [px]."""
    pixels = canvas.evaluate(READ_PIXELS, places)
    return [alpha > 200 and max(colour) < 160 for *colour, alpha in pixels]


def test_a_chart_is_exported_as_numbers_and_pictures(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit], tmp_path: Path
) -> None:
    page = visit(server.url).go(f"/jobs/{finished_job}")
    expect(page.locator("[data-dots]")).to_be_visible()
    # All six iterations, even if loaded before the chart.
    expect(page.locator(".uplot").first).to_have_attribute("data-range", "0 5")
    numbers = save(page, "Convergence", "Numbers (CSV)", tmp_path)
    assert numbers.name == "small-convergence.csv"
    with numbers.open(newline="") as file:
        rows = list(csv.DictReader(file))
    expected = server.client.get(f"/v1/jobs/{finished_job}/iterations").json()["items"]
    assert [float(row["Best so far"]) for row in rows] == [one["best_so_far"] for one in expected]

    saved = save(page, "Convergence", "Picture (SVG)", tmp_path)
    drawing = ET.parse(saved).getroot()  # noqa: S314 - created by the page
    words = [text.text for text in drawing.iter(f"{SVG}text")]
    assert {"Convergence", "best so far", "iteration"} <= set(words)
    # Vector lines: the best so far has a point for every iteration.
    lines = [path.get("d", "") for path in drawing.iter(f"{SVG}path")]
    assert any(len(re.findall("[ML]", line)) == len(expected) for line in lines)
    # Labels, and marks of values above the range.
    best, published = expected[-1]["best_so_far"], server.job(finished_job)["reference"]["fitness"]
    assert {f"best {best:#.4g}", f"published A {published:#.4g}"} <= set(words)
    places = re.compile(r"M(\S+) (\S+)L(\S+) (\S+)L\S+ (\S+)Z")
    marks = [
        [float(at) for at in match.groups()] for match in map(places.fullmatch, lines) if match
    ]
    assert len(marks) == int(page.locator("[data-above]").get_attribute("data-above") or 0) > 0
    # The marks point up, as in the legend.
    assert all(tip < foot == other for _, foot, _, other, tip in marks)
    assert "▴ worse designs outside the range shown" in words
    # They are at the same positions as on the screen.
    canvas = page.locator(".uplot canvas").first
    assert all(
        opaque(
            canvas,
            [((left + right) / 2, (2 * foot + tip) / 3) for left, foot, right, _, tip in marks],
        )
    )
    [dashed] = [line for line in drawing.iter(f"{SVG}path") if line.get("stroke-dasharray")]
    left, y, right, _ = map(float, re.findall(r"[-\d.]+", dashed.get("d", "")))
    along = opaque(canvas, [(left + (right - left) * step / 60, y) for step in range(1, 60)])
    assert 20 < sum(along) < 60
    assert not list(drawing.iter(f"{SVG}image"))

    picture = save(page, "Convergence", "Picture (PNG)", tmp_path).read_bytes()
    assert picture.startswith(b"\x89PNG")
    assert int.from_bytes(picture[16:20]) == 2 * int(drawing.get("width", "0"))


@pytest.mark.thorough("test_a_chart_is_exported_as_numbers_and_pictures")
def test_parallel_coordinates_export_every_design(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit], tmp_path: Path
) -> None:
    page = visit(server.url).go(f"/jobs/{finished_job}/variables")
    with save(page, "Designs by variable", "Numbers (CSV)", tmp_path).open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 48
    best = min(float(row["fitness"]) for row in rows if row["fitness"])
    expected = server.client.get(f"/v1/jobs/{finished_job}").json()["best"]["fitness"]
    assert best == pytest.approx(expected, rel=1e-6)
    page.keyboard.press("Escape")
    expect(page.get_by_role("menu")).to_have_count(0)


SENSITIVITY = "Sensitivity of the fitness"


@pytest.mark.thorough("test_a_chart_is_exported_as_numbers_and_pictures")
def test_limiting_factors_are_exported_with_column_names(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit], tmp_path: Path
) -> None:
    page = visit(server.url).go(f"/jobs/{finished_job}")
    card = page.get_by_role("region", name="Limiting factors", exact=True)
    saved = save(page, "Limiting factors", "Picture (SVG)", tmp_path)
    drawing = ET.parse(saved).getroot()  # noqa: S314 - created by the page
    drawn = " ".join(text.text or "" for text in drawing.iter(f"{SVG}text"))
    names = card.locator("thead th").all_inner_texts()
    assert len(names) > 3
    assert all(" ".join(name.split()) in drawn for name in names)

    file = save(page, "Limiting factors", "Numbers (CSV)", tmp_path)
    with file.open(newline="") as numbers:
        rows = list(csv.DictReader(numbers))
    expected = server.client.get(f"/v1/jobs/{finished_job}").json()["best"]["scenarios"]
    values = {(row["Scenario"], row["Objective"]): float(row["Value"]) for row in rows}
    assert {scenario for scenario, _ in values} == set(expected)
    for (scenario, objective), value in values.items():
        objectives = expected[scenario]["objectives"]
        if objective == "speed":
            assert value == 1.0 / objectives["reciprocal_speed"]
        else:
            assert value == objectives[objective.replace(" ", "_")]
    assert {row["Unit"] for row in rows if row["Objective"] == "speed"} == {"m/s"}
    sensitivities = {row["Objective"]: float(row[SENSITIVITY]) for row in rows}
    assert sensitivities["speed"] <= 0.0 <= sensitivities["energy"]
