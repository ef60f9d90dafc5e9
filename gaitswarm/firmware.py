"""`gaitswarm.write_firmware`: a design as C code in a folder."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from gaitswarm.errors import InvalidRequest
from gaitswarm.requests.firmware import FirmwareRequest, firmware_view, run_firmware
from gaitswarm.sim.controllers import ControllerName
from gaitswarm.sim.firmware import FORMAT, MANIFEST
from gaitswarm.sim.robot import DEFAULT_ROBOT
from gaitswarm.simulation import ALL_SCENARIOS
from gaitswarm.specs import RobotInput, ScenarioInput, checked
from gaitswarm.views.firmware import FirmwareView

_BUILT: Final = "build"
"""Build folder of the folder's Makefile."""


def write_firmware(
    design: Mapping[str, float | str],
    output: str | os.PathLike[str],
    *,
    scenarios: ScenarioInput | Iterable[ScenarioInput] = ALL_SCENARIOS,
    controller: ControllerName = "fuzzy-pi",
    robot: RobotInput = DEFAULT_ROBOT,
    label: str = "design",
    table_bits: tuple[int, int] | None = None,
) -> FirmwareView:
    """Write a design as C99 for a leg's microcontroller (thesis chapter 5), with a test of it.

    The design is simulated in every scenario; the folder's `make test` gives its controller the
    sensor readings and compares its outputs with the simulated ones, sample by sample.

    Args:
        design: Value of each of the controller's variables, and of any gait variable, in their
            units.
        output: Folder to write; one that holds firmware is replaced, as a whole or not at all.
        scenarios: Names or numbers of presets, or `Scenario`: whose trajectories are written and
            whose walks are repeated.
        controller: Motor controller that drives the robot.
        robot: A shipped robot by name, a `RobotVariant`, or the folder of another.
        label: Display name of the design.
        table_bits: Of the indices of angle error and current in a fuzzy controller's table, in
            place of 10 and 6, where there is less flash; simulations use this table, and their
            difference from those with the default one is reported.

    Returns:
        Files, their sizes, and their memory on the thesis's microcontroller.

    Raises:
        InvalidRequest: An argument is invalid, a gait leaves the legs' reach, or the folder
            holds anything but firmware or cannot be written; names the argument.
        EvaluatorUnavailable: The compiler does not compile the robot's kernel.
    """
    arguments = {
        "design": design,
        "scenarios": scenarios,
        "controller": controller,
        "robot": robot,
        "label": label,
        "table_bits": table_bits,
    }
    request = checked(FirmwareRequest, arguments)
    check_replaceable(output)
    firmware = run_firmware(request)
    write_folder(output, firmware.files)
    return firmware_view(request, firmware, str(output))


def check_replaceable(output: str | os.PathLike[str]) -> None:
    """Check that a folder is missing, empty, or holds firmware and its build output."""
    folder = Path(output)
    if not folder.exists():
        return
    if not folder.is_dir():
        raise InvalidRequest(f"{folder} is a file; name a folder", field="output")
    found = {
        path.relative_to(folder).as_posix()
        for path in folder.rglob("*")
        if not path.is_dir() and path.relative_to(folder).parts[0] != _BUILT
    }
    foreign = sorted(found - _written_files(folder))
    if foreign:
        raise InvalidRequest(
            f"{folder} holds files that are no firmware, such as {foreign[0]}; name another folder",
            field="output",
        )


def write_folder(output: str | os.PathLike[str], files: Mapping[str, bytes]) -> None:
    """Write files into a folder, replacing its contents."""
    with _replacing(Path(output)) as new:
        for name, content in files.items():
            path = new / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)


def _written_files(folder: Path) -> set[str]:
    try:
        manifest = json.loads((folder / MANIFEST).read_text(encoding="utf-8"))
        if manifest["format"] == FORMAT:
            return set(manifest["files"])
    except (OSError, ValueError, KeyError, TypeError):
        pass
    return set()


@contextmanager
def _replacing(folder: Path) -> Iterator[Path]:
    """A temporary folder that replaces the other one unless an exception is raised."""
    try:
        target = folder.resolve()
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(
            dir=target.parent, prefix=f".{target.name}.", ignore_cleanup_errors=True
        ) as scratch:
            new, old = Path(scratch) / "new", Path(scratch) / "old"
            new.mkdir()
            yield new
            if target.exists():
                target.rename(old)
            try:
                new.rename(target)
            except OSError:
                if old.exists():
                    old.rename(target)
                raise
    except OSError as error:
        raise InvalidRequest(f"cannot write {folder}: {error.strerror}", field="output") from error
