"""Evaluators: simulations in threads of this process, or on Ray"""

from __future__ import annotations

from typing import Literal

EvaluatorKind = Literal["auto", "ray", "in-process"]
"""`ray`: on Ray. `in-process`: in threads. `auto`: on Ray at an address; else in threads, and in a
server or runner on a local Ray as soon as it has started."""
