"""What a design comes to, named: equal keys stand for equal outcomes, whatever the job."""

from __future__ import annotations

import json
from hashlib import blake2b
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.sim.provenance import Provenance

KEY_BYTES: Final = 16
"""Of 10^12 different designs, two have the same key with a chance of 10^-15."""


def walk_keys(
    spec: Spec, provenance: Provenance, simulated: NDArray[np.float64]
) -> tuple[bytes, ...]:
    """Name the outcomes of designs in all cases of a job.

    A key is a digest of all that an outcome depends on: the design by name, as it is simulated; the
    fields of the spec that are not in `Spec.unwalked`; and what is simulated. It does not depend on
    whether a variable is searched or fixed, nor on the order of variables.
    """
    names = spec.design_space().names
    order = sorted(range(len(names)), key=names.__getitem__)
    document = spec.model_dump_json(exclude=set(spec.unwalked))
    walked = [document, provenance.model_dump_json(), [names[j] for j in order]]
    common = blake2b(json.dumps(walked).encode(), digest_size=32).digest()
    rows = np.ascontiguousarray(simulated[:, order])
    return tuple(blake2b(common + row.tobytes(), digest_size=KEY_BYTES).digest() for row in rows)
