"""Draw docs/images/concepts.svg, how the main concepts relate: python -m scripts.concepts

What a box says of its concept is the beginning of its entry in docs/glossary.md.
"""

from __future__ import annotations

import re
import sys
import textwrap
from pathlib import Path
from typing import Final

from scripts.boxes import Box, Edge, Picture

ROOT: Final = Path(__file__).parents[1]

PICTURE: Final = ROOT / "docs" / "images" / "concepts.svg"

GLOSSARY: Final = ROOT / "docs" / "glossary.md"

ROWS: Final = (
    ("job", "certificate"),
    ("iteration", "world"),
    ("design", "scenario"),
    ("walk",),
    ("objective", "preference"),
    ("utility",),
    ("fitness",),
)
"""Where a concept is drawn, from the top. Every arrow must lead downwards or along its row."""

ARROWS: Final[dict[Edge, str]] = {
    ("certificate", "job"): "is a",
    ("certificate", "world"): "draws many a",
    ("job", "iteration"): "consists of",
    ("iteration", "design"): "tries a",
    ("world", "scenario"): "perturbs a",
    ("design", "walk"): "is simulated in a",
    ("scenario", "walk"): "is the task of a",
    ("walk", "objective"): "yields each",
    ("objective", "utility"): "goes into the",
    ("preference", "utility"): "weighs for the",
    ("utility", "fitness"): "averages to the",
}
"""What is said of two concepts."""

_LONGEST: Final = 62
"""Characters of a line that a box has room for."""


def entries() -> dict[str, str]:
    """What the glossary says of every word."""
    text = GLOSSARY.read_text(encoding="utf-8")
    found = re.findall(r"^(\S[^\n]*)\n: (.*?)(?=\n\n|\Z)", text, re.MULTILINE | re.DOTALL)
    return {word: " ".join(entry.split()) for word, entry in found}


def drawn() -> str:
    """The picture as SVG."""
    known = entries()
    boxes = {concept: _box(concept, known[concept]) for row in ROWS for concept in row}
    return Picture("How the concepts relate", ROWS, boxes).drawn(ARROWS, words=True)


def _box(concept: str, entry: str) -> Box:
    """With the first sentence of the entry."""
    sentence = re.split(r"\. |\.$", entry.replace("`", ""))[0]
    fill = "#f3efe4" if concept in ("world", "certificate") else "#e8f0f8"
    return Box(concept, textwrap.wrap(sentence, _LONGEST), fill)


def main() -> int:
    """Write the picture."""
    PICTURE.write_text(drawn(), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
