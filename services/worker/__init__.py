"""Where walks run: in threads of this process, or on Ray."""

from __future__ import annotations

from typing import Literal

EvaluatorKind = Literal["ray", "in-process"]
"""Processes of a Ray cluster, or threads of this process."""
