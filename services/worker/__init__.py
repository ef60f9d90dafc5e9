"""Evaluators: simulations in threads of this process, or on Ray"""

from __future__ import annotations

from typing import Literal

EvaluatorKind = Literal["auto", "ray", "in-process"]
"""`ray`: on Ray. `in-process`: in threads. `auto`: on Ray at an address and in servers and runners;
else in threads."""
