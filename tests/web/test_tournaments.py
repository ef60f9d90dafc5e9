"""Tournaments on the page: found, judged, looked at problem by problem."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import closing
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from api.page import FOLDER
from services.optimizer.service import JobService
from services.optimizer.store.sql_store import open_store
from tests.examples.servers import Server
from tests.tournament.examples import entrant, submitted
from tests.web.test_views import PHONE, findings
from tests.web.visit import Visit

pytestmark = pytest.mark.slow

RUNS = {
    "pso": [1e-4, 0.2, 0.3, 0.4],
    "de": [1e-4, 1e-4, 0.1, 0.2],
    "random": [0.5, 0.6, 0.7, 0.8],
    "ps": [0.3, 0.4, 0.5, 0.6],
    "sa": [0.35, 0.45, 0.5, 0.6],
    "tlbo": [0.45, 0.55, 0.65, 0.7],
}
"""Best values of six methods, of which five have a colour."""


@pytest.fixture(scope="module")
def raced(tmp_path_factory: pytest.TempPathFactory, _chromium: str) -> Iterator[Raced]:
    """A server of a module's own."""
    with closing(open_store(str(tmp_path_factory.mktemp("tournaments") / "jobs.db"))) as store:
        found = Raced(JobService(store))
        yield found
        found.server.close()


class Raced:
    """A server with two tournaments, one of which has no run yet.

    Attributes:
        jobs: Ids of the jobs of the other, by method.
        waiting: Id of the job without a run.
    """

    def __init__(self, service: JobService) -> None:
        self.jobs = {m: submitted(service, entrant(m, m), v).id for m, v in RUNS.items()}
        elsewhere = entrant("pso", "pso", problems=[{"function": "D4C0R0I0"}])
        self.waiting = submitted(service, elsewhere).id
        self.server = Server(service, page_folder=FOLDER)
        self.id = self.jobs["pso"]


def as_table(page: Page, title: str) -> None:
    chart = page.get_by_role("region", name=re.compile(f"^{title}"))
    chart.get_by_role("button", name=re.compile("^Show as table")).first.click()


def opened(visited: Visit, path: str) -> Page:
    page = visited.go(path)
    page.wait_for_load_state("networkidle")
    return page


def test_tournaments_are_listed_and_lead_to_their_ranks(
    raced: Raced, visit: Callable[..., Visit]
) -> None:
    page = visit(raced.server.url).go("/jobs")
    page.get_by_role("link", name="Tournaments", exact=True).click()
    row = page.locator(f"[data-tournament='{raced.id}']")
    expect(row).to_contain_text("pso, de, random, ps, sa, tlbo")
    expect(row.get_by_role("cell", name="24", exact=True)).to_be_visible()
    row.get_by_role("link").click()

    expect(page).to_have_url(re.compile(f"/tournaments/{raced.id}$"))
    bars = page.get_by_role("region", name="Mean ranks").locator(".range-track[role=img]")
    expect(bars).to_have_count(len(RUNS))
    expect(bars.first).to_have_attribute("aria-label", re.compile("^de: mean rank 1"))
    as_table(page, "Mean ranks")
    ranks = page.get_by_role("table", name="Mean ranks")
    expect(ranks.get_by_role("rowheader")).to_have_text(["de", "pso", "ps", "sa", "tlbo", "random"])
    ranks.get_by_role("link", name=raced.jobs["random"]).click()
    page.get_by_role("link", name=re.compile("^Its tournament")).click()
    expect(page.get_by_role("heading", name=re.compile("^Tournament on D4C1R0I1"))).to_be_visible()


def test_charts_of_a_problem_have_their_numbers_as_tables(
    raced: Raced, visit: Callable[..., Visit]
) -> None:
    page = opened(visit(raced.server.url), f"/tournaments/{raced.id}?problem=D7C0R1I1")
    expect(page.get_by_role("heading", name="Problem D7C0R1I1")).to_be_visible()
    expect(page.get_by_role("img", name=re.compile("^Median fitness of 6 methods"))).to_be_visible()
    expect(page.get_by_role("img", name=re.compile("^Best fitness of 24 runs"))).to_be_visible()

    found: Any = raced.server.client.get(f"/v1/tournaments/{raced.id}").json()
    as_table(page, "Expected running time")
    standings = page.get_by_role("table", name="Standings on D7C0R1I1")
    for method, told in found["problems"]["D7C0R1I1"]["methods"].items():
        row = standings.locator(f"[data-method='{method}']")
        expect(row).to_contain_text(f"{told['solved']} of 4")
        time = told["expected_running_time"]["value"]
        expect(row.get_by_role("cell").nth(2)).to_have_text("–" if time is None else f"{time:.0f}")
    as_table(page, "Best so far")
    curves = page.get_by_role("table", name=re.compile("^Median of the best so far"))
    expect(curves.get_by_role("rowheader")).to_have_text(["1", "10", "40"])
    as_table(page, "Performance cloud")
    runs = page.get_by_role("table", name="Runs on D7C0R1I1")
    expect(runs.locator("tbody tr")).to_have_count(24)
    as_table(page, "Data profile, τ = 0.1")
    expect(page.get_by_role("table", name=re.compile("^Share of solved runs"))).to_be_visible()

    page.get_by_role("combobox", name=re.compile("^Problem")).select_option("D4C1R0I1")
    expect(page).to_have_url(re.compile("problem=D4C1R0I1"))
    expect(page.get_by_role("table", name="Runs on D4C1R0I1")).to_be_visible()


def test_methods_in_colour_are_part_of_the_address(
    raced: Raced, visit: Callable[..., Visit]
) -> None:
    page = opened(visit(raced.server.url), f"/tournaments/{raced.id}")
    expect(page.get_by_role("checkbox", name="random")).to_be_disabled()
    page.get_by_role("checkbox", name="de").uncheck()
    page.get_by_role("checkbox", name="random").check()
    page.reload()
    expect(page.get_by_role("checkbox", name="random")).to_be_checked()
    expect(page.get_by_role("checkbox", name="de")).not_to_be_checked()
    assert raced.jobs["random"] in page.url


def test_what_is_not_there_yet_or_at_all_says_so(
    raced: Raced, visit: Callable[..., Visit], start_server: Callable[..., Server]
) -> None:
    refused = "status of 4(04|09|22)"
    visited = visit(raced.server.url, allowed=refused)
    page = opened(visited, f"/tournaments/{raced.waiting}")
    expect(page.get_by_role("heading", name="No run has ended yet")).to_be_visible()
    page = opened(visited, "/tournaments/nosuchjob")
    expect(page.get_by_role("alert")).to_contain_text("nosuchjob")
    page = opened(visited, f"/tournaments/{raced.id}?compare={raced.waiting}")
    expect(page.get_by_role("alert")).to_contain_text("has ended yet")
    page = opened(visit(start_server().url), "/tournaments")
    expect(page.get_by_role("heading", name="No tournaments yet")).to_be_visible()
    expect(page.get_by_text("gaitswarm tournament thesis")).to_be_visible()


@pytest.mark.variants("list")
@pytest.mark.parametrize("path", ["", "/{id}?problem=D7C0R1I1"], ids=["list", "one"])
def test_every_eye_hand_and_width_can_use_it(
    raced: Raced, visit: Callable[..., Visit], path: str
) -> None:
    visited = visit(raced.server.url, color_scheme="light", viewport=PHONE, bypass_csp=True)
    page = opened(visited, f"/tournaments{path.format(id=raced.id)}")
    assert findings(page) == {}
