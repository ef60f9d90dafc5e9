"""Shell commands in README and docs."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from itertools import dropwhile

from tests.documents.reader import BLOCK, SHELL
from tests.examples.paths import ROOT

DOCUMENTS = [
    ROOT / "README.md",
    *sorted((ROOT / "docs").glob("*.md")),
    *sorted((ROOT / "docs" / "reference").glob("*.md")),
]

_ENDS = ("|", "||", "&&", ";", "&", ">", ">>", "2>", "<", "#")


def documentation() -> str:
    return "\n".join(path.read_text(encoding="utf-8") for path in DOCUMENTS)


def blocks(kind: str) -> Iterator[str]:
    """Contents of the code blocks of one language."""
    return (body for language, body in BLOCK.findall(documentation()) if language == kind)


def shell_commands(program: str) -> list[list[str]]:
    """Arguments of every call of a program in a shell block or between backquotes."""
    text = documentation()
    inline = re.findall(r"`([^`\n]+)`", BLOCK.sub("", text))
    return [*calls(text, program), *(call for line in inline for call in _calls(line, program))]


def typed_commands(program: str) -> list[list[str]]:
    """Arguments of every call of a program in a shell block: whole commands, to be typed."""
    return calls(documentation(), program)


def calls(text: str, program: str) -> list[list[str]]:
    """Arguments of every call of a program in the shell blocks of a text, in their order."""
    shell = [body for language, body in BLOCK.findall(text) if language in SHELL]
    lines = "\n".join(shell).replace("\\\n", " ").splitlines()
    return [call for line in lines for call in _calls(line, program)]


def _calls(line: str, program: str) -> Iterator[list[str]]:
    for part in re.split(r"&&|\|\||[;|]|\$\(", line.removeprefix("$ ")):
        try:
            words = shlex.split(part.strip().rstrip(")"), comments=True)
        except ValueError:
            continue
        words = list(dropwhile(re.compile(r"[A-Z_]+=\S*").fullmatch, words))
        if words and words[0].rpartition("/")[2] == program:
            ends = [k for k, word in enumerate(words) if word in _ENDS]
            yield words[1 : ends[0] if ends else None]
