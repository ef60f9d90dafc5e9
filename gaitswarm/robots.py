"""Robots of one's own, made from a URDF."""

from __future__ import annotations

import json
import os
import re
import shutil
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import NDArray

from gaitswarm.errors import simulation_errors
from gaitswarm.mesh_copies import MeshCopies, copy_meshes
from gaitswarm.mesh_library import FORMS, LARGEST_MESH
from gaitswarm.meshes import find_mesh
from gaitswarm.robot_defaults import JOB_FILE
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.proposal.apart import walking_proposal
from gaitswarm.sim.proposal.document import Proposal
from gaitswarm.sim.proposal.drive import ActuatorChoice
from gaitswarm.sim.proposal.frame import Axis, Frame
from gaitswarm.sim.robot.bounds import LONGEST_URDF, check_urdf
from gaitswarm.sim.robot.shapes import mesh_bounds

_NAME: Final = re.compile(r"\w[^/\\]{0,99}")


@dataclass(frozen=True, slots=True)
class MadeRobot:
    """A robot's folder that was written.

    Attributes:
        name: of the robot.
        guesses: what to look at, one sentence each.
        meshes: what became of the meshes that the URDF names.
    """

    name: str
    guesses: tuple[str, ...]
    meshes: MeshCopies


def init_robot(
    urdf: str | os.PathLike[str],
    output: str | os.PathLike[str],
    *,
    name: str | None = None,
    actuator: ActuatorChoice = "auto",
    up: Axis | None = None,
    forward: Axis | None = None,
    meshes: bool = True,
    packages: Sequence[str | os.PathLike[str]] = (),
) -> MadeRobot:
    """Make a robot's folder from a URDF: legs, stance, actuators and two walks are chosen.

    The meshes that the URDF names are copied, so that the folder can be shown wherever it goes.
    What is missing, no STL, OBJ or DAE, or too large is left out: no simulation needs them.
    """
    source, folder = Path(urdf), Path(output)
    _check_free(folder)
    try:
        with source.open(encoding="utf-8") as file:
            text = file.read(LONGEST_URDF + 1)
    except UnicodeDecodeError as error:
        raise InvalidRequest(not_utf8(source, error), field="urdf") from error
    except OSError as error:
        raise InvalidRequest(f"cannot read {source}: {error}", field="urdf") from error
    chosen = (own_name(text) or source.stem) if name is None else name
    check_name(chosen)
    frame = frame_of(up, forward)
    try:
        bounds = partial(_bounds, folder=source.parent, packages=[Path(p) for p in packages])
        proposal = walking_proposal(text, chosen, actuator, frame, bounds)
    except RobotFileError as error:
        said = str(error).replace("robot.urdf", source.name, 1)
        raise InvalidRequest(said, field="urdf") from error
    with simulation_errors("urdf"):
        copies = _write(folder, proposal, source.parent if meshes else None, packages)
    return MadeRobot(chosen, proposal.notes, copies)


def not_utf8(path: Path, error: UnicodeDecodeError) -> str:
    """What to say of a file that cannot be decoded."""
    byte = error.object[error.start]
    return (
        f"cannot read {path}: it is not UTF-8 text (byte 0x{byte:02x} at {error.start}); save it as"
        " UTF-8"
    )


def check_name(name: str) -> None:
    """Check the name of a robot: firmware, exports and folders are named by it."""
    if not _NAME.fullmatch(name) or not name.isprintable():
        raise InvalidRequest(
            f"{name[:100]!r} cannot name a robot; 1 to 100 printable characters can that begin with"
            " a letter or digit and have no / and no \\",
            field="name",
        )


def own_name(urdf: str) -> str | None:
    """Name that a URDF gives its robot."""
    try:
        check_urdf(urdf)
    except RobotFileError:
        return None
    name = ET.fromstring(urdf).get("name", "").strip()  # noqa: S314 - it has kept all bounds
    return name if _NAME.fullmatch(name) and name.isprintable() else None


def frame_of(up: Axis | None, forward: Axis | None) -> Frame:
    """Axes of a URDF's first link."""
    frame = Frame(up, forward)
    if not frame.right_angled:
        raise InvalidRequest(
            f"{forward or 'x'} cannot point ahead where {up or 'z'} points up; name an axis at"
            " right angles to it",
            field="forward",
        )
    return frame


def _bounds(name: str, folder: Path, packages: Sequence[Path]) -> NDArray[np.float64] | None:
    """Of a mesh that is found and not too large."""
    path = find_mesh(name, folder, packages)
    if path is None or path.suffix.lower() not in FORMS or path.stat().st_size > LARGEST_MESH:
        return None
    return mesh_bounds(path)


def _check_free(folder: Path) -> None:
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InvalidRequest(f"{folder} is there and not empty; name another", field="output")


def _write(
    folder: Path,
    proposal: Proposal,
    source: Path | None,
    packages: Sequence[str | os.PathLike[str]],
) -> MeshCopies:
    """With the meshes that are found from a source folder, if there is one."""
    copies = MeshCopies()
    job = json.dumps(proposal.job, indent=2) + "\n"
    texts = {"robot.toml": proposal.toml, "robot.urdf": proposal.urdf, JOB_FILE: job}
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        made = Path(tempfile.mkdtemp(prefix=f".{folder.name}.", dir=folder.parent))
        try:
            for file, text in texts.items():
                (made / file).write_text(text, encoding="utf-8")
            if source is not None:
                copies = copy_meshes(proposal.urdf, source, made, [Path(p) for p in packages])
            made.chmod(0o755)
            if folder.exists():
                folder.rmdir()
            made.rename(folder)
        except BaseException:
            shutil.rmtree(made, ignore_errors=True)
            raise
    except OSError as error:
        raise InvalidRequest(f"cannot write {folder}: {error.strerror}", field="output") from error
    return copies
