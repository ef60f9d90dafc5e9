"""`python -m tests.golden` recomputes the golden numbers, and `git diff` shows what moved.

Only to be run when numbers are meant to change; the commit then says why they do.
"""

from __future__ import annotations

import sys

from tests.golden.numbers import FILE, measure, write

write(measure())
sys.stdout.write(f"wrote {FILE}\n")
