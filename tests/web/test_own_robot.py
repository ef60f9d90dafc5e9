"""A robot of one's own: its meshes, and what is Szabadka-II's and so not shown with it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import expect

from tests.examples.meshes import DAE, OBJ, tetrahedron, with_mesh
from tests.examples.paths import QUADRUPED
from tests.examples.servers import ServerProcess
from tests.web.pixels import painted
from tests.web.visit import Visit

pytestmark = pytest.mark.slow

MESHES = {"body.stl": tetrahedron(0.1), "plate.obj": OBJ, "sheet.dae": DAE}


def green(image: NDArray[np.uint8]) -> int:
    """Pixels in the colour of the meshes' material, lit or in the shade."""
    r, g, b = (image[..., k].astype(int) for k in range(3))
    return int(((g > 2 * r) & (g > 2 * b) & (g > 40)).sum())


def test_meshes_of_a_robot_of_ones_own_are_drawn_and_can_be_switched_off(
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

    expect(page.get_by_text("This robot has no published design.")).to_be_visible()
    expect(page.get_by_label("Scenario").locator("option")).to_have_count(1)
    page.goto(f"{server.url}/jobs/{job_id}/scenarios")
    expect(page.get_by_text("This robot has no published design.")).to_be_visible()
    expect(page.get_by_label("Compare with")).to_have_value("nothing")
