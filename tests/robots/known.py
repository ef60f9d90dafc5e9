"""URDFs of the PyPI package example-robot-data, unedited."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Final

from tests.examples import requirements

FOLDER: Final = Path(sys.prefix) / "robots"
"""Where scripts/robots.sh puts the package's URDFs."""

QUADRUPEDS: Final = {
    "a1": "a1_description/urdf/a1.urdf",
    "go1": "go1_description/urdf/go1.urdf",
    "go2": "go2_description/urdf/go2.urdf",
    "b1": "b1_description/urdf/b1.urdf",
    "b1-z1": "b1_description/urdf/b1-z1.urdf",
    "laikago": "laikago_description/urdf/laikago.urdf",
    "anymal_b": "anymal_b_simple_description/robots/anymal.urdf",
    "anymal_b-kinova": "anymal_b_simple_description/robots/anymal-kinova.urdf",
    "anymal_c": "anymal_c_simple_description/urdf/anymal.urdf",
    "solo12": "solo_description/robots/solo12.urdf",
    "hyq": "hyq_description/robots/hyq_no_sensors.urdf",
}
"""Robots of the package whose legs have three joints, by name."""

CENTAURO: Final = "centauro_description/urdf/centauro.urdf"
"""A quadruped with legs of five joints and a wheel, a torso and two arms."""

BIPED: Final = "bolt_description/robots/bolt.urdf"
"""The only other one with such legs."""


HEXAPODS_AND_OTHERS: Final = {
    "phantomx": "HumaRobotics/phantomx_description/urdf/phantomx.xacro",
    "phantomx_ros": "KevinOchs/hexapod_ros/hexapod_description/urdf/phantomX_model.xacro",
    "hexapod_ros": "KevinOchs/hexapod_ros/hexapod_description/urdf/hexapod_model.xacro",
    "spot_micro": "OpenQuadruped/spot_mini_mini/mini_ros/urdf/spot.urdf",
    "go1 (MJCF)": "google-deepmind/mujoco_menagerie/unitree_go1/go1.xml",
    "a2 (MJCF)": "unitreerobotics/unitree_ros/robots/a2_description/a2.xml",
    "go2w": "unitreerobotics/unitree_ros/robots/go2w_description/urdf/go2w_description.urdf",
}
"""Robots in files of repositories: xacro, MJCF, wheels, placeholder masses, four joints a leg."""

ROBOTS: Final = {
    **{name: FOLDER / file for name, file in QUADRUPEDS.items()},
    "centauro": FOLDER / CENTAURO,
    **{name: FOLDER.parent / "repositories" / file for name, file in HEXAPODS_AND_OTHERS.items()},
}
"""Files of all, by name."""


def urdf_of(file: str) -> Path:
    """A file of the package; the test is skipped, or fails if it must run, where it is missing."""
    path = FOLDER / file
    requirements.ROBOTS.check(
        "" if path.is_file() else "their URDFs are missing: run scripts/robots.sh"
    )
    return path
