"""Custom robots: meshes, URDF import, and hidden features of Szabadka-II."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import expect

from tests.examples.meshes import DAE, OBJ, tetrahedron, with_mesh
from tests.examples.paths import QUADRUPED
from tests.examples.servers import Server, ServerProcess
from tests.robots.test_obstacles import LIMITS, longer
from tests.robots.test_proposal import dog
from tests.web.pixels import painted
from tests.web.visit import Visit

pytestmark = pytest.mark.slow

UNEVEN = longer(f'type="revolute">{LIMITS}', legs=("FL", "FR", "RL"))
"""A dog of which three legs have a joint more than the last."""

MESHES = {"body.stl": tetrahedron(0.1), "plate.obj": OBJ, "sheet.dae": DAE}


def green(image: NDArray[np.uint8]) -> int:
    """Number of pixels in the colour of the meshes' material."""
    r, g, b = (image[..., k].astype(int) for k in range(3))
    return int(((g > 2 * r) & (g > 2 * b) & (g > 40)).sum())


@pytest.mark.thorough("test_a_urdf_is_simulated_and_submitted, with meshes")
def test_meshes_of_a_custom_robot_are_drawn_and_can_be_hidden(
    server: ServerProcess, robots: Path, visit: Callable[..., Visit]
) -> None:
    urdf = with_mesh((QUADRUPED / "robot.urdf").read_text(encoding="utf-8"), *MESHES)
    folder = robots / "quadruped"
    folder.mkdir()
    (folder / "robot.urdf").write_text(urdf, encoding="utf-8")
    for name, content in MESHES.items():
        (folder / name).write_bytes(content)
    crawl = json.loads((QUADRUPED / "crawl.json").read_text(encoding="utf-8")) | {"cycles": 1}
    toml = (QUADRUPED / "robot.toml").read_text(encoding="utf-8")
    job_id = server.submit(
        {
            "robot": {"toml": toml, "urdf": urdf},
            "controller": "pi",
            "scenarios": [crawl],
            "variables": [{"name": "P", "low": 0.9, "high": 1.0}],
            "fixed": {"I": 0.0},
            "optimizer": {"name": "pso", "particles": 2},
            "iterations": 1,
        }
    )
    server.wait_for(job_id, "succeeded")

    page = visit(server.url).go(f"/walk?job={job_id}")
    player = page.locator("[data-player]")
    expect(player).to_have_attribute("data-meshes", str(len(MESHES)))
    canvas = player.locator("canvas")
    meshes = page.get_by_label("Meshes")
    expect(meshes).to_be_checked()
    painted(canvas, lambda image: green(image) > 100)
    meshes.uncheck()
    painted(canvas, lambda image: green(image) == 0)

    expect(page.get_by_text("gaitswarm serve --robots FOLDER")).to_have_count(0)
    (folder / "robot.urdf").unlink()
    page.reload()
    expect(player).to_have_attribute("data-meshes", "0")
    expect(page.get_by_text("gaitswarm serve --robots FOLDER")).to_be_visible()

    expect(page.get_by_text("There is no published design for this robot.")).to_be_visible()
    expect(page.get_by_label("Scenario").locator("option")).to_have_count(1)
    page.goto(f"{server.url}/jobs/{job_id}")
    expect(page.get_by_text("There is no published design for this robot.")).to_be_visible()
    expect(page.get_by_label("Compare with")).to_have_value("start design")


def test_a_urdf_is_simulated_and_submitted(
    start_server: Callable[..., Server], tmp_path: Path, visit: Callable[..., Visit]
) -> None:
    server = start_server()

    def file(name: str, text: str) -> Path:
        (tmp_path / name).write_text(text, encoding="utf-8")
        return tmp_path / name

    page = visit(server.url, allowed="422").go("/jobs/new")
    page.get_by_role("button", name="My robot").click()
    # Nothing is refused before there is a robot.
    expect(page.get_by_role("button", name="Submit the job")).to_be_disabled()
    expect(page.get_by_role("alert")).to_have_count(0)
    urdf = page.get_by_label("URDF, xacro or MJCF")
    urdf.set_input_files(file("broken.urdf", dog().replace("-2.7", "-120")))
    error = page.get_by_role("alert").filter(has_text="Could not create a robot from broken.urdf.")
    expect(error).to_contain_text(re.compile("urdf: .*line .*in degrees"))
    expect(page.get_by_text("in degrees")).to_have_count(1)

    urdf.set_input_files(file("dog.urdf", dog(foot="cylinder")))
    results = page.get_by_role("region", name="Check results")
    expect(results).to_contain_text("dog: 4 legs, 12 joints, 11.60 kg")
    expect(results.get_by_role("row").filter(has_text="FL_calf_joint")).to_contain_text("0.480")
    expect(error).to_have_count(0)
    start = page.get_by_role("region", name="Start design")
    start.get_by_label("Scenario to simulate").select_option("fast")
    start.get_by_role("button", name="Simulate").click()
    expect(start.locator("[data-ended='ok']")).to_be_visible()
    expect(start.get_by_role("img", name="Replay of the preview design")).to_be_visible()

    page.get_by_text("robot.toml: settings missing in the URDF").click()
    toml = page.get_by_label("Text of robot.toml")
    proposed = toml.input_value()
    toml.fill(proposed.replace("load_height", "load_hight"))
    expect(results).to_have_count(0)
    page.get_by_role("button", name="Check the robot again").click()
    missing = page.get_by_role("alert").filter(has_text="load_height: is missing")
    expect(missing.first).to_be_visible()
    toml.fill(proposed.replace("load_height = 0.05", "load_height = 0.07"))
    page.get_by_role("button", name="Check the robot again").click()
    expect(results).to_be_visible()

    slow = page.locator("[data-custom='0']")
    slow.get_by_text("slow", exact=True).click()
    drop = slow.get_by_label(re.compile("^drop"))
    expect(drop).to_be_hidden()
    slow.get_by_text(re.compile("more settings, all at their defaults")).click()
    drop.fill("0.01")
    drop.fill("")
    expect(drop).to_be_visible()

    page.get_by_role("button", name="Submit the job").click()
    expect(page).to_have_url(re.compile(r"/jobs/(?!new)[^/?]+$"))
    spec = server.job(page.url.rsplit("/", 1)[1])["spec"]
    assert "load_height = 0.07" in spec["robot"]["toml"]
    assert [scenario["name"] for scenario in spec["scenarios"]] == ["slow", "fast"]


@pytest.mark.thorough("test_a_urdf_is_simulated_and_submitted, with surplus joints and servos")
def test_a_robot_with_surplus_joints_and_named_servos_is_made_and_submitted(
    start_server: Callable[..., Server], tmp_path: Path, visit: Callable[..., Visit]
) -> None:
    server = start_server()
    (tmp_path / "dog.urdf").write_text(UNEVEN, encoding="utf-8")
    page = visit(server.url, allowed="422").go("/jobs/new")
    page.get_by_role("button", name="My robot").click()
    page.get_by_label("URDF, xacro or MJCF").set_input_files(tmp_path / "dog.urdf")
    error = page.get_by_role("alert").filter(has_text="Could not create a robot from dog.urdf.")
    expect(error).to_contain_text("hold surplus ones, as `--lock FL_toe_joint=0`")
    held = page.get_by_label("Held joints", exact=True)
    generate = page.get_by_role("button", name="Generate robot.toml")
    held.fill("*_toe_joint=low")
    generate.click()
    expect(page.get_by_role("alert")).to_contain_text("locks.*_toe_joint")
    held.fill("F?_toe_joint=0.1 RL_toe_joint=0")
    page.get_by_label("Mass [kg]").fill("14.5")
    page.get_by_label("Listed actuators").fill("*=mx64")
    generate.click()
    results = page.get_by_role("region", name="Check results")
    expect(results).to_contain_text("dog: 4 legs, 12 joints, 14.50 kg")
    expect(results).to_contain_text("FL_toe_joint at 0.1 rad")
    expect(page.get_by_label("Text of robot.toml")).to_have_value(re.compile("Dynamixel MX-64"))
    page.get_by_role("button", name="Submit the job").click()
    expect(page).to_have_url(re.compile(r"/jobs/(?!new)[^/?]+$"))
    spec = server.job(page.url.rsplit("/", 1)[1])["spec"]
    assert spec["controller"] == "servo" and spec["variables"][0]["name"] == "P"
    assert spec["robot"]["toml"].count("[actuators.mx64.servo]") == 1
