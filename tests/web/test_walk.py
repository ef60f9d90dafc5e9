"""Replays of walks."""

from __future__ import annotations

import json
import re
import struct
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import httpx2
import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Locator, Page, Route, expect

from tests.examples.servers import ServerProcess, unframed
from tests.web.pixels import colourful, other_than, painted
from tests.web.visit import Visit

pytestmark = pytest.mark.slow


@dataclass(frozen=True)
class Recording:
    """header: of the replay format. frames: (n, floats)."""

    header: dict[str, Any]
    frames: NDArray[np.float32]

    def body(self, frame: int) -> list[float]:
        """Position of the body [m]."""
        offset = next(c["offset"] for c in self.header["channels"] if c["name"] == "link_pose")
        return [float(value) for value in self.frames[frame, offset : offset + 3]]

    def travel(self) -> list[list[float]]:
        """Range of each leg's joint angles [rad]."""
        offset, (joints,) = next(
            (c["offset"], c["shape"]) for c in self.header["channels"] if c["name"] == "joint_angle"
        )
        travel = np.ptp(self.frames[:, offset : offset + joints], axis=0)
        return [[float(angle) for angle in leg] for leg in travel.reshape(-1, 3)]


def replay(client: httpx2.Client, **request: Any) -> Recording:
    content = client.post("/v1/replays", json=request | {"rate": 100}).content
    header, numbers = unframed(content)
    return Recording(header, numbers.reshape(header["frames"], -1))


def player(page: Page) -> Locator:
    """The player once its canvas is visible."""
    element = page.locator("[data-player]")
    expect(element.locator("canvas")).to_be_visible()
    return element


def expect_frame(page: Page, frame: int, recording: Recording) -> None:
    """Expect this frame with the body at the simulated position."""
    shown = player(page)
    expect(shown).to_have_attribute("data-frame", str(frame))
    place = [float(shown.get_attribute(f"data-{axis}") or "nan") for axis in "xyz"]
    assert place == pytest.approx(recording.body(frame), abs=1e-4)


def test_an_iteration_links_to_its_designs_and_a_design_to_its_walk(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    where = f"/v1/jobs/{finished_job}/iterations/2/evaluations"
    evaluation = server.client.get(where).json()["items"][3]
    page = visit(server.url).go(f"/jobs/{finished_job}/iterations")
    page.locator('[data-index="2"]').get_by_role("link").click()
    page.locator('[data-particle="3"]').get_by_role("link", name="3", exact=True).click()

    expect(page).to_have_url(re.compile(r"/walk\?"))
    scenario = server.job(finished_job)["spec"]["scenarios"][0]
    design = evaluation["design"]
    recording = replay(server.client, controller="fuzzy-pi", design=design, scenario=scenario)
    expect_frame(page, 0, recording)
    objectives = page.get_by_role("table", name="Objectives of the walk")
    energy = objectives.get_by_role("row").filter(has_text="energy").get_by_role("cell")
    expected = evaluation["scenarios"]["short"]["objectives"]["energy"]
    assert float(energy.inner_text()) == pytest.approx(expected, rel=1e-3)


def test_a_replay_can_be_scrubbed_stepped_and_played(
    server: ServerProcess, visit: Callable[..., Visit]
) -> None:
    published = server.client.get("/v1/controllers").json()["items"]
    design = next(c["published"]["A"] for c in published if c["name"] == "fuzzy-pi")
    recording = replay(server.client, controller="fuzzy-pi", design=design, scenario="normal-fast")
    visited = visit(server.url, viewport={"width": 720, "height": 720})
    page = visited.go("/walk?published=A&scenario=normal-fast")
    expect_frame(page, 0, recording)
    stage = player(page).locator("canvas")
    first = painted(stage, colourful(200))

    moment = page.get_by_label("Time in the walk")
    moment.fill("150")
    expect_frame(page, 150, recording)
    page.get_by_label("Next frame").click()
    expect_frame(page, 151, recording)
    painted(stage, other_than(first))

    # Playback stops at the end. Slowly at first, so that the playing state can be observed.
    last = recording.header["frames"] - 1
    moment.fill(str(last - 50))
    page.get_by_label("Speed").select_option("0.25")
    page.get_by_role("button", name="Play").click()
    expect(player(page)).to_have_attribute("data-playing", "true")
    page.get_by_label("Speed").select_option("4")
    expect(player(page)).to_have_attribute("data-playing", "false")
    expect_frame(page, last, recording)


def on_rough_ground(route: Route, *, with_heights: bool) -> None:
    """Answer the page's request for a replay by the same walk in a rough world."""
    asked = json.loads(route.request.post_data or "")
    world = {"roughness": 0.02, "world_seed": 7}
    header, numbers = unframed(route.fetch(post_data=asked | {"world": world}).body())
    assert np.ptp(header["ground"]["heights"]["z"]) > 0.01
    if not with_heights:
        header["ground"]["heights"] = None
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 4)
    route.fulfill(body=struct.pack("<I", len(text)) + text + numbers.tobytes())


def test_uneven_ground_is_drawn(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    pictures = []
    visited = visit(server.url, viewport={"width": 480, "height": 480})
    for with_heights in (True, False):
        visited.page.route("**/v1/replays", partial(on_rough_ground, with_heights=with_heights))
        page = visited.go(f"/walk?job={finished_job}&scenario=short")
        pictures.append(painted(player(page).locator("canvas"), colourful(200)))
        visited.page.unroute("**/v1/replays")
    uneven, flat = pictures
    assert (uneven != flat).any(axis=2).mean() > 0.1


WITHOUT_MP4 = """() => {
    const isSupported = MediaRecorder.isTypeSupported
    MediaRecorder.isTypeSupported = (type) => !type.includes('mp4') && isSupported(type)
}"""


@pytest.mark.thorough("the browser's video encoder")
def test_a_replay_is_saved_as_mp4_where_the_browser_can(
    server: ServerProcess, visit: Callable[..., Visit]
) -> None:
    page = visit(server.url).go("/walk?published=A&scenario=normal-fast&t=0.5")
    player(page)
    page.get_by_role("button", name="Save as video").click()
    dialog = page.get_by_role("dialog", name="Save as video")
    dialog.get_by_label("Size").select_option(label="640 × 360")
    dialog.get_by_label("Speed").select_option("4")
    with page.expect_download() as download:
        dialog.get_by_role("button", name="Record").click()
    assert download.value.suggested_filename == "walk-normal-fast.mp4"
    assert download.value.path().read_bytes()[4:8] == b"ftyp"


@pytest.mark.thorough("the browser's video encoder")
def test_a_replay_is_saved_as_a_video_with_the_chosen_size_and_speed(
    server: ServerProcess, visit: Callable[..., Visit]
) -> None:
    page = visit(server.url).go("/walk?published=A&scenario=normal-fast&t=0.5")
    page.evaluate(WITHOUT_MP4)
    shown = player(page)
    with page.expect_download() as download:
        page.get_by_role("button", name="Save as picture").click()
    assert (
        download.value.suggested_filename == "published-a-fuzzy-pi-scenario-normal-fast-0-50-s.png"
    )
    still = Path(download.value.path()).read_bytes()
    assert still.startswith(b"\x89PNG")
    before = shown.locator("canvas").bounding_box()
    assert before is not None
    assert int.from_bytes(still[16:20]) == 2 * round(before["width"])

    page.get_by_role("button", name="Save as video").click()
    dialog = page.get_by_role("dialog", name="Save as video")
    dialog.get_by_label("Size").select_option(label="640 × 360")
    # A stopped recording is not saved.
    dialog.get_by_label("Speed").select_option("0.1")
    dialog.get_by_role("button", name="Record").click()
    expect(dialog.get_by_role("progressbar")).to_be_visible()
    dialog.get_by_role("button", name="Stop recording").click()

    dialog.get_by_label("Speed").select_option("4")
    duration = float((shown.locator(".moment").inner_text()).split()[2])
    expect(dialog).to_contain_text(f"Recording takes {duration / 4:.1f}")
    with page.expect_download() as download:
        dialog.get_by_role("button", name="Record").click()
    assert download.value.suggested_filename == "walk-normal-fast.webm"
    video = download.value.path().read_bytes()
    # EBML header, document type, width and height of the track (RFC 9559).
    assert video[:4] == bytes.fromhex("1a45dfa3") and b"webm" in video[:64]
    assert bytes.fromhex("b0820280") in video and bytes.fromhex("ba820168") in video
    # On a slow machine, the first frame lasts longer.
    assert 0.7 < video_seconds(video) / (duration / 4) < 3.0

    # The replay returns to its previous state.
    expect(dialog).to_have_count(0)
    expect(shown).to_have_attribute("data-time", "0.5000")
    assert shown.locator("canvas").bounding_box() == before

    page.evaluate("delete window.MediaRecorder")
    page.get_by_role("button", name="Save as video").click()
    expect(dialog.get_by_role("alert")).to_contain_text("cannot record")
    expect(dialog.get_by_role("button", name="Record")).to_have_count(0)


def video_seconds(video: bytes) -> float:
    """Duration of a WebM [s], stored as a float in milliseconds."""
    at = video.index(bytes.fromhex("4489")) + 2
    size = video[at] & 0x7F
    (milliseconds,) = struct.unpack(">f" if size == 4 else ">d", video[at + 1 : at + 1 + size])
    return float(milliseconds) / 1000


def goes_backward(walk: Recording) -> bool:
    return walk.body(-1)[0] < -0.2


def falls_onto_its_feet(walk: Recording) -> bool:
    """Falls from 30 mm above the stance within 0.2 s."""
    return walk.body(0)[2] - walk.body(20)[2] > 0.03


def holds_one_leg_still(walk: Recording) -> bool:
    return [max(leg) < 0.05 for leg in walk.travel()].count(True) == 1


@pytest.mark.thorough("test_a_replay_can_be_scrubbed_stepped_and_played, of other scenarios")
@pytest.mark.parametrize(
    ("scenario", "shows"),
    [
        ("backward", goes_backward),
        ("drop", falls_onto_its_feet),
        ("stuck-leg", holds_one_leg_still),
    ],
)
def test_additional_presets_are_shown_to_the_end(
    server: ServerProcess,
    visit: Callable[..., Visit],
    scenario: str,
    shows: Callable[[Recording], bool],
) -> None:
    published = server.client.get("/v1/controllers").json()["items"]
    design = next(c["published"]["A"] for c in published if c["name"] == "fuzzy-pi")
    recording = replay(server.client, controller="fuzzy-pi", design=design, scenario=scenario)
    assert shows(recording)
    page = visit(server.url).go(f"/walk?published=A&scenario={scenario}")
    expect_frame(page, 0, recording)

    last = recording.header["frames"] - 1
    page.get_by_label("Time in the walk").fill(str(last))
    expect_frame(page, last, recording)
    # The camera follows: the robot remains in view.
    painted(player(page).locator("canvas"), colourful(200))


def test_the_robot_stays_in_view_and_its_figures_are_compared_with_the_baseline(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    page = visit(server.url).go(f"/jobs/{finished_job}/walk?against=published:A")
    canvas = player(page).locator("canvas")
    figures = page.locator("[data-figures]")
    expect(figures).to_contain_text("Cost of transport")
    expect(figures).to_contain_text(re.compile("of stall"))
    # The chosen design is judged, not the baseline.
    job = server.job(finished_job)
    scenario = job["spec"]["scenarios"][0]
    published = server.client.get("/v1/controllers").json()["items"]
    baseline = next(c["published"]["A"] for c in published if c["name"] == "fuzzy-pi")
    ours, theirs = (
        replay(server.client, controller="fuzzy-pi", design=design, scenario=scenario)
        for design in (job["best"]["design"], baseline)
    )
    slowness = [each.header["objectives"]["reciprocal_speed"] for each in (ours, theirs)]
    tone = "better" if slowness[0] < slowness[1] else "worse"
    speed = figures.locator("div").filter(has_text="Speed").locator(".judged")
    expect(speed).to_have_attribute("data-tone", tone)
    row = page.get_by_role("table", name="Objectives of the walk").locator("tr", has_text="speed")
    expect(row).to_contain_text(f"{1 / slowness[0]:#.4g}")
    expect(row).to_contain_text("m/s")

    page.get_by_role("region", name="Objectives", exact=True).scroll_into_view_if_needed()
    expect(canvas).to_be_in_viewport(ratio=0.5)
    page.set_viewport_size({"width": 390, "height": 844})
    page.get_by_role("region", name="Objectives", exact=True).scroll_into_view_if_needed()
    expect(canvas).to_be_in_viewport(ratio=0.5)
    expect(page.get_by_role("button", name="Pause").or_(page.get_by_role("button", name="Play"))
        .first).to_be_in_viewport()  # fmt: skip


@pytest.mark.thorough("test_a_replay_can_be_scrubbed_stepped_and_played, twice")
def test_two_walks_are_compared(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    page = visit(server.url).go(f"/walk?job={finished_job}&against=published:A")
    player(page)

    objectives = page.get_by_role("table", name="Objectives of the walk")
    expect(
        objectives.get_by_role("row").filter(has_text="energy").get_by_role("cell")
    ).to_have_count(3)
    stage = player(page).locator("canvas")
    ghost = painted(stage, colourful(200))
    page.get_by_role("button", name="Side by side").click()
    expect(page.get_by_role("button", name="Side by side")).to_have_attribute(
        "aria-pressed", "true"
    )
    painted(stage, other_than(ghost))


@pytest.mark.thorough("test_a_replay_can_be_scrubbed_stepped_and_played")
def test_a_failed_walk_shows_the_reason(server: ServerProcess, visit: Callable[..., Visit]) -> None:
    page = visit(server.url).go('/walk?controller=p&design={"P":0}')

    status = page.locator("[data-status]")
    expect(status).to_have_attribute("data-status", "stalled")
    expect(status).to_contain_text("robot did not move forward")
