"""Requests of the HTTP API about single designs, as values: what is sent, and how it is read."""

from __future__ import annotations

from gaitswarm.jobs.server.call import Call, posted, segment
from gaitswarm.requests.firmware import FirmwareRequest
from gaitswarm.requests.robustness import RobustnessRequest
from gaitswarm.requests.simulations import ReplayRequest, SimulationRequest
from gaitswarm.requests.surface import SurfaceRequest
from gaitswarm.sim.controllers import ControllerName
from gaitswarm.simulation_result import SimulationResult
from gaitswarm.views import SimulationView
from gaitswarm.views.analysis import SurfaceView
from gaitswarm.views.firmware import FirmwareView
from gaitswarm.views.replay import WalkReplay, decoded_replay
from gaitswarm.views.robustness import RobustnessView
from gaitswarm.zip_archive import unzipped


def simulate(request: SimulationRequest) -> Call[SimulationResult]:
    """Let one design walk.

    Args:
        request: The design and its walks.
    """

    def read(content: bytes) -> SimulationResult:
        return SimulationResult.from_view(SimulationView.model_validate_json(content))

    return Call("POST", "/simulations", read, body=request.model_dump_json(), reads=True)


def robustness(request: RobustnessRequest) -> Call[RobustnessView]:
    """Estimate how robust a design is.

    Args:
        request: The design, its walks and the sample.
    """
    return posted("/robustness", RobustnessView, request, reads=True)


def replay(request: ReplayRequest) -> Call[WalkReplay]:
    """Let one design walk, to look at it.

    Args:
        request: The design and its walk.
    """
    body = request.model_dump_json()
    return Call("POST", "/replays", decoded_replay, body=body, reads=True)


def surface(controller: ControllerName, request: SurfaceRequest) -> Call[SurfaceView]:
    """Take a fuzzy controller's surfaces.

    Args:
        controller: Name of the controller.
        request: The design, and how finely to look at it.
    """
    path = f"/controllers/{segment(controller, 'controller')}/surface"
    return posted(path, SurfaceView, request, reads=True)


def firmware(request: FirmwareRequest) -> Call[dict[str, bytes]]:
    """Take a design's firmware, content by path.

    Args:
        request: The design and its scenarios.
    """
    return Call("POST", "/firmware", unzipped, body=request.model_dump_json(), reads=True)


def firmware_summary(request: FirmwareRequest) -> Call[FirmwareView]:
    """Find out what a design's firmware holds and takes.

    Args:
        request: The design and its scenarios.
    """
    return posted("/firmware/summary", FirmwareView, request, reads=True)
