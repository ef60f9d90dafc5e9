"""Where walks run: in threads of this process, or on Ray."""

from __future__ import annotations

from typing import Literal

EvaluatorKind = Literal["ray", "in-process"]
"""Threads of this process, and Ray in long jobs or at an address; or threads throughout."""
