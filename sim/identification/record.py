"""From a measured log to what a fit needs of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, cast

import numpy as np

from sim.controllers import ControllerName
from sim.controllers.fixed_point import CONTROL_PERIOD
from sim.identification.recorded_walk import RecordedWalk
from sim.scenario import Scenario
from sim.validation.synchronise import Synchronised

_DECIMALS: Final = 5
"""Of a stored current [A]: far below the converter's step, and a third of the text."""


def record(
    pair: Synchronised,
    scenario: Scenario,
    controller: str,
    design: Mapping[str, float],
) -> RecordedWalk:
    """The measured currents of two synchronised logs, on the simulated one's time axis.

    scenario, controller, design: those of the walk that was simulated for the synchronisation.
    """
    return RecordedWalk(
        scenario=scenario,
        controller=cast(ControllerName, controller),
        design=dict(design),
        first_tick=round(float(pair.simulated.time[0]) / CONTROL_PERIOD),
        joints=pair.measured.joints,
        current=np.round(pair.measured.current, _DECIMALS).tolist(),
        synthetic=pair.measured.synthetic,
    )
