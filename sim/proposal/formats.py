"""URDF text of robots that are described in xacro or MJCF."""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, redirect_stderr, suppress
from importlib.util import find_spec
from io import StringIO
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import Any, Final, Literal
from unittest.mock import patch
from xml.etree import ElementTree as ET
from xml.parsers import expat

import numpy as np

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.memory import rotations
from gaitswarm.sim.proposal.legs import FOOT_NAME
from gaitswarm.sim.robot.bounds import check_urdf

PackageFinder = Callable[[str], str]
"""Returns the folder of a ROS package by its name; raises RobotFileError if there is none."""

ELSEWHERE: Final = "needs other files; convert it next to them: gaitswarm robot init FILE"


def require(module: str, form: str) -> None:
    if find_spec(module) is None:
        raise RobotFileError(
            f"robot.urdf: a robot in {form} needs pip install 'gaitswarm[{module}]', which is not"
            " installed here; or convert it to a URDF"
        )


def no_package(name: str) -> str:
    raise RobotFileError(f"package {name!r} is not at hand")


def expanded(
    text: str,
    path: Path | None = None,
    find: PackageFinder = no_package,
    arguments: Mapping[str, str] = MappingProxyType({}),
) -> str:
    """Expand a xacro text; None as the path of its file marks it as untrusted."""
    check_urdf(text)
    require("xacro", "xacro")
    import xacro  # noqa: PLC0415  an extra

    # xacro asks ROS for packages, which is not installed on most machines.
    packages = ModuleType("ament_index_python.packages")
    packages.__dict__["get_package_share_directory"] = find
    ros = {"ament_index_python": ModuleType("ament_index_python"), packages.__name__: packages}
    try:
        with (
            patch.dict(sys.modules, ros),
            redirect_stderr(StringIO()),
            _restricted(xacro, trusted=path is not None),
        ):
            xacro.init_stacks(None if path is None else str(path))
            document = xacro.parse(text)
            xacro.process_doc(document, mappings=dict(arguments))
            return str(document.toprettyxml(indent="  "))
    except Exception as error:  # expressions may raise anything
        cause: BaseException = error
        while isinstance(inner := getattr(cause, "exc", None), BaseException):
            cause = inner
        said = str(cause if isinstance(cause, RobotFileError) else error)
        if "Undefined substitution argument" in said:
            said += "; give its value (`--arg NAME=VALUE`)"
        raise RobotFileError(f"robot.urdf: xacro: {' '.join(said.split())[:500]}") from error


_COMPUTES: Final = (
    *(ast.Expression, ast.Constant, ast.Name, ast.Load, ast.BinOp, ast.UnaryOp, ast.BoolOp),
    *(ast.operator, ast.unaryop, ast.boolop, ast.cmpop, ast.Compare, ast.IfExp, ast.Call),
    *(ast.Subscript, ast.Slice, ast.List, ast.Tuple, ast.Dict),
)


@contextmanager
def _restricted(xacro: Any, *, trusted: bool) -> Iterator[None]:
    """Keep an untrusted text from other files, the environment and Python's objects."""
    if trusted:
        yield
        return
    evaluate, substitute = xacro.safe_eval, xacro.eval_extension

    def computed(expression: str, *symbols: Any) -> Any:
        for node in ast.walk(ast.parse(expression.strip(), mode="eval")):
            if isinstance(node, ast.Attribute):
                module = isinstance(node.value, ast.Name) and node.value.id in ("math", "python")
                allowed = module and not node.attr.startswith("_") and node.attr not in _TOO_FREE
            else:
                allowed = isinstance(node, _COMPUTES) and getattr(node, "id", "") not in _TOO_FREE
            if not allowed:
                raise RobotFileError(f"the expression {expression[:100]!r} does more than compute")
        return evaluate(expression, *symbols)

    def substituted(text: str) -> Any:
        if re.fullmatch(r"\$\(arg \w+\)", text):
            return substitute(text)
        raise RobotFileError(f"{text[:100]} {ELSEWHERE}")

    def included(*_: object) -> None:
        raise RobotFileError(f"<xacro:include> {ELSEWHERE}")

    with patch.multiple(
        xacro, safe_eval=computed, eval_extension=substituted, process_include=included
    ):
        yield


_TOO_FREE: Final = frozenset({"load_yaml", "abs_filename", "xacro", "type", "vars"})
"""Functions of xacro's expressions that read files or reach Python's objects."""


_OPEN_FILES: Final = frozenset({"include", "model", "flexcomp", "composite", "plugin"})
"""Elements that read files already when the text is parsed."""


def mjcf_to_urdf(text: str, path: Path | None = None) -> tuple[str, list[str]]:
    """Convert MJCF; None as the path of its file marks it as untrusted.

    Returns:
        The URDF of the tree with most mass, and what was left out or assumed, one sentence each.
    """
    if path is None:
        check_urdf(text)
    require("mujoco", "MJCF")
    import mujoco  # noqa: PLC0415  an extra

    if path is None:
        for element in ET.fromstring(text).iter():  # noqa: S314 - it was checked above
            if element.tag in _OPEN_FILES:
                raise RobotFileError(f"robot.urdf: MJCF: <{element.tag}> {ELSEWHERE}")
    try:
        spec = (
            mujoco.MjSpec.from_string(text)
            if path is None
            else mujoco.MjSpec.from_file(str(path.resolve()))
        )
        notes = _without_files(spec, path)
        model = spec.compile()
    except (ValueError, RuntimeError) as error:
        said = " ".join(str(error).split())[:500]
        raise RobotFileError(f"robot.urdf: MuJoCo cannot compile it: {said}") from error
    if model.neq:
        notes.append(f"{model.neq} equality constraints are left out: loops and couplings are open")
    if model.nu:
        notes.append(f"MJCF has no speed limits: {_SPEED:g} rad/s are assumed")
    return _urdf_of(spec, model, notes), notes


def _without_files(spec: Any, path: Path | None) -> list[str]:
    """Remove textures, height fields, skins, and meshes that are not at hand."""
    for material in spec.materials:
        material.textures = [""] * len(material.textures)
    for assets in (spec.textures, spec.skins):
        for asset in list(assets):
            spec.delete(asset)
    lost = {
        mesh.name or Path(mesh.file).stem: mesh
        for mesh in spec.meshes
        if mesh.file and (path is None or not (path.parent / _file_of(mesh)).is_file())
    }
    fields = {field.name for field in spec.hfields}
    for geom in list(spec.geoms):
        if geom.meshname in lost or (geom.hfieldname and geom.hfieldname in fields):
            spec.delete(geom)
    for asset in [*lost.values(), *spec.hfields]:
        spec.delete(asset)
    more = f" and {len(lost) - _LISTED} more" if len(lost) > _LISTED else ""
    return [f"meshes that are not at hand: {', '.join([*lost][:_LISTED])}{more}"] if lost else []


_LISTED: Final = 6
"""Meshes that a note lists."""


def _file_of(mesh: Any) -> Path:
    return Path(str(mesh.compiler.meshdir), str(mesh.file))


_JOINT_KINDS: Final = {2: "prismatic", 3: "revolute"}
"""By MuJoCo's number; 0 is free, 1 a ball."""

_SLIDES: Final = min(_JOINT_KINDS)

_SHAPES: Final = {2: "sphere", 3: "capsule", 5: "cylinder", 6: "box"}
"""By MuJoCo's number."""

_MESH: Final = 7

_SPEED: Final = 20.0
"""Speed limit of joints with actuators, which have none in MuJoCo [rad/s]."""

_FAR: Final = 1000.0
"""Limit of a sliding joint without limits [m]."""


def _urdf_of(spec: Any, model: Any, notes: list[str]) -> str:
    roots = [b for b in range(1, model.nbody) if model.body_parentid[b] == 0]
    if not roots:
        raise RobotFileError("robot.urdf: MJCF: there is no <body> in its <worldbody>")
    first = max(roots, key=lambda b: float(model.body_subtreemass[b]))
    robot = ET.Element("robot", name=spec.modelname or "robot")
    # By body: name of its link, and the link's frame, which is at the joint, in the body's.
    links: dict[int, tuple[str, Floats]] = {}
    efforts, dynamics = _efforts(model), _dynamics(model, notes)
    for body in range(first, model.nbody):
        parent = int(model.body_parentid[body])
        if body != first and parent not in links:
            continue
        name = model.body(body).name or f"body{body}"
        joints = range(model.body_jntadr[body], model.body_jntadr[body] + model.body_jntnum[body])
        shift = np.zeros(3)
        if body != first:
            before, at = links[parent]
            place, turn = model.body_pos[body] - at, model.body_quat[body]
            for joint in joints:
                shift, last = model.jnt_pos[joint], shift
                place = place + _matrix(turn) @ (shift - last)
                link = name if joint == joints[-1] else f"{name}_{joint}"
                _add_joint(robot, model, joint, before, link, place, turn, efforts, dynamics)
                if link != name:
                    ET.SubElement(robot, "link", name=link)
                before, place, turn = link, np.zeros(3), _UPRIGHT
            if not joints:
                _connect(robot, f"{name}_fixed", "fixed", before, name, place, turn)
        elif any(model.jnt_type[joint] for joint in joints):
            notes.append(f"joints of the body {name!r} are left out: it moves freely")
        links[body] = (name, shift)
        _add_link(robot, spec, model, body, name, shift)
    ET.indent(robot)
    return ET.tostring(robot, encoding="unicode")


def _add_joint(
    robot: ET.Element,
    model: Any,
    number: int,
    parent: str,
    child: str,
    place: Floats,
    turn: Floats,
    efforts: Floats,
    dynamics: Floats,
) -> None:
    name = model.joint(number).name or f"{child}_joint"
    kind = _JOINT_KINDS.get(int(model.jnt_type[number]))
    if kind is None:
        raise RobotFileError(
            f"robot.urdf: MJCF: joint {name!r} is a ball or free; replace it by hinges"
        )
    limited = bool(model.jnt_limited[number])
    lower, upper = (model.jnt_range[number] if limited else np.array([-_FAR, _FAR])) - (
        model.qpos0[model.jnt_qposadr[number]]
    )
    if kind == "revolute" and not limited:
        kind = "continuous"
    joint = _connect(robot, name, kind, parent, child, place, turn)
    ET.SubElement(joint, "axis", xyz=_text(model.jnt_axis[number]))
    limits = {} if kind == "continuous" else {"lower": f"{lower:.9g}", "upper": f"{upper:.9g}"}
    effort, speed = efforts[number], _SPEED if efforts[number] > 0.0 else 0.0
    ET.SubElement(joint, "limit", limits | {"effort": f"{effort:.9g}", "velocity": f"{speed:g}"})
    if dynamics[number].any():
        names = ("armature", "damping", "friction")
        values = (f"{value:.9g}" for value in dynamics[number].tolist())
        ET.SubElement(joint, "dynamics", dict(zip(names, values, strict=True)))


def _efforts(model: Any) -> Floats:
    """Largest torque of every joint's actuators, 0 if unknown, (n_joints,) [N m]."""
    efforts = np.zeros(model.njnt)
    for k in range(model.nu):
        of_joint = model.actuator_trntype[k] <= 1
        motor = model.actuator_gaintype[k] == 0 and model.actuator_biastype[k] == 0
        if model.actuator_forcelimited[k]:
            force = float(np.abs(model.actuator_forcerange[k]).max())
        elif motor and model.actuator_ctrllimited[k]:
            force = float(np.abs(model.actuator_ctrlrange[k] * model.actuator_gainprm[k, 0]).max())
        else:
            continue
        if of_joint:
            efforts[model.actuator_trnid[k, 0]] += force * abs(float(model.actuator_gear[k, 0]))
    ranges = np.abs(model.jnt_actfrcrange).max(axis=1)
    capped = np.where(efforts > 0.0, np.minimum(efforts, ranges), ranges)
    return np.where(model.jnt_actfrclimited.astype(bool), capped, efforts)


def _dynamics(model: Any, notes: list[str]) -> Floats:
    """Armature [kg m2], damping [N m s/rad] and dry friction [N m] of joints, (n_joints, 3)."""
    of_axes = np.stack([model.dof_armature, model.dof_damping, model.dof_frictionloss], axis=1)
    dynamics = np.where(model.jnt_type[:, None] >= _SLIDES, of_axes[model.jnt_dofadr], 0.0)
    gains = []
    for k in range(model.nu):
        if model.actuator_trntype[k] > 1:
            continue
        joint, gear = model.actuator_trnid[k, 0], float(model.actuator_gear[k, 0])
        _, stiffness, damping = -model.actuator_biasprm[k, :3] * gear**2
        if stiffness > 0.0:
            # Without a derivative gain of its own, a position loop has the joint's damping.
            if damping == 0.0:
                damping, dynamics[joint, 1] = dynamics[joint, 1], 0.0
            gains.append((float(stiffness), float(damping)))
        rotor = model.actuator_armature[k], model.actuator_damping[k]
        dynamics[joint, :2] += gear**2 * np.array(rotor)
    if gains:
        (least, slow), (most, fast) = np.min(gains, axis=0), np.max(gains, axis=0)
        notes.append(
            f"position loops of the MJCF have {_span(least, most)} N m/rad and"
            f" {_span(slow, fast)} N m s/rad; controllers here have gains of their own"
        )
    return dynamics


def _span(least: float, most: float) -> str:
    return f"{least:.3g}" if least == most else f"{least:.3g} to {most:.3g}"


def _add_link(
    robot: ET.Element, spec: Any, model: Any, body: int, name: str, shift: Floats
) -> None:
    link = ET.SubElement(robot, "link", name=name)
    if model.body_mass[body] > 0.0:
        inertial = ET.SubElement(link, "inertial")
        ET.SubElement(inertial, "origin", xyz=_text(model.body_ipos[body] - shift))
        ET.SubElement(inertial, "mass", value=f"{model.body_mass[body]:.9g}")
        turn = _matrix(model.body_iquat[body])
        tensor = turn @ np.diag(model.body_inertia[body]) @ turn.T
        entries = {
            f"i{'xyz'[i]}{'xyz'[j]}": f"{tensor[i, j]:.12g}" for i in range(3) for j in range(i, 3)
        }
        ET.SubElement(inertial, "inertia", entries)
    for geom in range(
        model.body_geomadr[body], model.body_geomadr[body] + model.body_geomnum[body]
    ):
        _add_shape(link, spec, model, geom, shift)
    for site in range(model.nsite):
        label = model.site(site).name
        if model.site_bodyid[site] == body and FOOT_NAME.search(label):
            foot = label if spec.body(label) is None else f"{label}_site"
            ET.SubElement(robot, "link", name=foot)
            at = model.site_pos[site] - shift
            _connect(robot, f"{foot}_fixed", "fixed", name, foot, at, _UPRIGHT)


def _add_shape(link: ET.Element, spec: Any, model: Any, geom: int, shift: Floats) -> None:
    kind, size = int(model.geom_type[geom]), model.geom_size[geom]
    place, turn = model.geom_pos[geom], _matrix(model.geom_quat[geom])
    touches = model.geom_contype[geom] or model.geom_conaffinity[geom]
    if kind == _MESH:
        # The compiler moves a mesh's origin to its centre of mass and turns it to its main axes.
        number = int(model.geom_dataid[geom])
        turn = turn @ _matrix(model.mesh_quat[number]).T
        place = place - turn @ model.mesh_pos[number]
        mesh = spec.mesh(model.mesh(number).name)
        attributes = {"filename": _file_of(mesh).as_posix(), "scale": _text(mesh.scale)}
        if not mesh.file:
            return
        tag, touches = "mesh", False
    elif kind in _SHAPES:
        tag = _SHAPES[kind]
        attributes = {"size": _text(2.0 * size)} if tag == "box" else {"radius": f"{size[0]:.9g}"}
        if tag in ("capsule", "cylinder"):
            attributes["length"] = f"{2.0 * size[1]:.9g}"
    else:
        return
    part = ET.SubElement(link, "collision" if touches else "visual")
    _set_origin(part, place - shift, turn)
    ET.SubElement(ET.SubElement(part, "geometry"), tag, attributes)
    if not touches:
        material = int(model.geom_matid[geom])
        colour = model.geom_rgba[geom] if material < 0 else model.mat_rgba[material]
        ET.SubElement(ET.SubElement(part, "material", name=""), "color", rgba=_text(colour))


_UPRIGHT: Final = np.array([1.0, 0.0, 0.0, 0.0])
"""Quaternion w x y z."""


def _connect(
    robot: ET.Element, name: str, kind: str, parent: str, child: str, place: Floats, turn: Floats
) -> ET.Element:
    joint = ET.SubElement(robot, "joint", name=name, type=kind)
    ET.SubElement(joint, "parent", link=parent)
    ET.SubElement(joint, "child", link=child)
    _set_origin(joint, place, _matrix(turn))
    return joint


def _set_origin(element: ET.Element, place: Floats, turn: Floats) -> None:
    rpy = rotations().from_matrix(turn).as_euler("xyz", suppress_warnings=True)
    ET.SubElement(element, "origin", xyz=_text(place), rpy=_text(rpy))


def _matrix(quaternion: Floats) -> Floats:
    """Rotation matrix (3, 3) of a quaternion w x y z."""
    return np.asarray(rotations().from_quat(quaternion, scalar_first=True).as_matrix())


def _text(numbers: Floats) -> str:
    return " ".join(f"{number:.9g}" for number in np.asarray(numbers).tolist())


Format = Literal["urdf", "xacro", "mjcf"]


def as_urdf(
    text: str,
    path: Path | None = None,
    find: PackageFinder = no_package,
    arguments: Mapping[str, str] = MappingProxyType({}),
) -> tuple[str, list[str]]:
    """Convert a robot's description to a URDF.

    Args:
        text: Of the description.
        path: Of its file, next to which others may be; None for an untrusted text, which may name
            no other file and whose expressions may only compute.
        find: Finder of the packages that a xacro file names.
        arguments: Values of its <xacro:arg>.

    Returns:
        The URDF, and what was left out or assumed, one sentence each.
    """
    form = format_of(text)
    if form == "xacro":
        return expanded(text, path, find, arguments), []
    return mjcf_to_urdf(text, path) if form == "mjcf" else (text, [])


def format_of(text: str) -> Format:
    """Infer a format from the elements; malformed text counts as a URDF."""
    elements: list[tuple[str, dict[str, str]]] = []
    parser = expat.ParserCreate()
    parser.StartElementHandler = lambda tag, attributes: elements.append((tag, attributes))
    with suppress(expat.ExpatError):
        parser.Parse(text, True)
    if elements and elements[0][0] == "mujoco":
        return "mjcf"
    # A URDF that xacro has written still declares its namespace.
    expands = "${" in text or any(tag.startswith("xacro:") for tag, _ in elements)
    return "xacro" if expands and "xmlns:xacro" in elements[0][1] else "urdf"
