"""Code blocks of README and docs/, run as they are printed, one after the other.

Blocks that run are Python (`python`) and shell (`console`). In a shell block with prompts, `$ `
begins a command, and the lines below it are what the command says; without prompts every line is a
command. `gaitswarm` and `curl` run in this process, `export` sets a variable of it, all else is for
the shell. What a block of Python says is in the block of `text` below it.

What is said is compared by words: `...` stands for anything, numbers may differ by 2 %, `ID` is the
job that was made last, forks aside, and `DIGEST` the head of its history.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
from collections.abc import Iterator, Mapping
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from io import StringIO
from pathlib import Path
from typing import Any, Final

import httpx2

from gaitswarm.cli.main import run
from tests.examples.commands import run_command
from tests.examples.paths import ROOT

ADDRESS: Final = "http://127.0.0.1:8000"
"""Of the server in README and docs/."""

BLOCK: Final = re.compile(r"^ *```([^\n]*)\n(.*?)^ *```", re.MULTILINE | re.DOTALL)
"""A fenced block, also in a list: its language and its contents."""

SHELL: Final = ("", "sh", "bash", "console", "shell")

_JOB = re.compile(
    r"^job ([a-z0-9]{12}) in database|\"id\": ?\"([a-z0-9]{12})\"|^([a-z0-9]{12})$", re.MULTILINE
)
_NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?$")
_MARGIN = 0.02


@dataclass(frozen=True, slots=True)
class Block:
    """A block of a document, with the line before which it begins."""

    language: str
    text: str
    document: str
    line: int

    @property
    def where(self) -> str:
        return f"{self.document}:{self.line + 1}"


def blocks_of(document: str, section: str = "") -> Iterator[Block]:
    """Blocks of a document, by its path in the repository, or of one of its sections."""
    text = (ROOT / document).read_text(encoding="utf-8")
    begin = text.index(f"\n## {section}\n") if section else 0
    end = text.find("\n## ", begin + 1) if section else len(text)
    for match in BLOCK.finditer(text, begin, end if end > 0 else len(text)):
        yield Block(match[1], match[2], document, text[: match.start(2)].count("\n"))


@dataclass
class Reader:
    """Someone who types what a document shows.

    Attributes:
        server: URL of the server in place of the printed one.
        replaced: what is typed otherwise than printed, so that it takes less time.
        skipped: commands that are not run, by how they begin, each with its reason.
        names: of Python, afterwards.
        answers: to curl.
    """

    server: str
    replaced: Mapping[str, str] = field(default_factory=dict)
    skipped: Mapping[str, str] = field(default_factory=dict)
    names: dict[str, Any] = field(default_factory=lambda: {"__name__": "__main__"})
    answers: list[httpx2.Response] = field(default_factory=list)
    job_id: str = "ID"

    def read(self, document: str, section: str = "", languages: str = "python console") -> None:
        """Run all blocks of these languages in the present folder; fails where one is not true."""
        said = ""
        for block in blocks_of(document, section):
            if block.language not in (*languages.split(), "text"):
                continue
            if block.language == "python":
                said = self._python(block)
            elif block.language == "console":
                self._console(block)
            else:
                assert_says(said, block.text, block.where)

    def read_notebook(self, notebook: str) -> str:
        """Run the cells of a notebook, by its path in the repository; what they say."""
        cells = json.loads((ROOT / notebook).read_text(encoding="utf-8"))["cells"]
        code = [cell for cell in cells if cell["cell_type"] == "code"]
        blocks = (
            Block("python", "".join(cell["source"]), f"{notebook}, cell {k}", 0)
            for k, cell in enumerate(code, start=1)
        )
        return "".join(map(self._python, blocks))

    def _python(self, block: Block) -> str:
        code = "\n" * block.line + self._typed(block.text)
        out = StringIO()
        with redirect_stdout(out):
            exec(compile(code, block.where, "exec"), self.names)  # noqa: S102
        return out.getvalue()

    def _console(self, block: Block) -> None:
        for command, expected in commands(block.text):
            if command.startswith(tuple(self.skipped)):
                continue
            said = self._command(self._typed(command))
            for found in () if command.startswith("gaitswarm fork ") else _JOB.finditer(said):
                self.job_id = found[found.lastindex or 0]
            if expected:
                assert_says(said, self._typed(expected), f"{block.where}: {command}")

    def _typed(self, text: str) -> str:
        for printed, typed in {ADDRESS: self.server, **self.replaced}.items():
            text = text.replace(printed, typed)
        if "DIGEST" in text:
            text = text.replace("DIGEST", run_command("status", self.job_id, "--json").json["head"])
        return re.sub(r"\bID\b", self.job_id, text)

    def _command(self, command: str) -> str:
        """What a command says on both streams; fails if it fails."""
        program, *words = shlex.split(command, comments=True)
        if program == "export":
            name, _, value = words[0].partition("=")
            os.environ[name] = value
            return ""
        if program == "gaitswarm":
            # The server is there already.
            return "" if words[0] == "serve" else _gaitswarm(words)
        if program == "curl":
            return self._curl(words)
        shell = subprocess.run(  # noqa: S602 - our own documents
            command, shell=True, check=True, capture_output=True, text=True
        )
        return shell.stdout + shell.stderr

    def _curl(self, words: list[str]) -> str:
        method, headers, content, url = "GET", {}, None, ""
        rest = iter(words)
        for word in rest:
            if word == "-X":
                method = next(rest)
            elif word == "-H":
                name, value = next(rest).split(": ")
                headers[name] = value
            elif word == "-d":
                content = next(rest)
            elif word not in ("-s", "-N"):
                assert word.startswith("http"), f"what is {word}?"
                url = word
        answer = httpx2.request(method, url, headers=headers, content=content, timeout=60.0)
        assert answer.status_code < 300, (words, answer.text)
        self.answers.append(answer)
        return answer.text


def _gaitswarm(words: list[str]) -> str:
    target = Path(words[words.index(">") + 1]) if ">" in words else None
    out, err = StringIO(), StringIO()
    with redirect_stdout(out), redirect_stderr(err if target else out):
        code = run(words[: words.index(">")] if target else words)
    assert code == 0, (words, out.getvalue(), err.getvalue())
    if target is None:
        return out.getvalue()
    target.write_text(out.getvalue(), encoding="utf-8")
    return err.getvalue()


def commands(text: str) -> Iterator[tuple[str, str]]:
    """Commands of a shell block with what is printed below each."""
    prompts = text.startswith("$ ")
    lines = iter(text.splitlines())
    command = ""
    said: list[str] = []
    for line in lines:
        if prompts and not line.startswith("$ "):
            said.append(line)
            continue
        if command:
            yield command, "\n".join(said)
        command, said = line.removeprefix("$ "), []
        while command.endswith("\\"):
            command = command[:-1] + next(lines)
        if here := re.search(r"<<'?(\w+)'?$", command):
            for line in lines:  # noqa: PLW2901
                command += f"\n{line}"
                if line == here[1]:
                    break
    if command:
        yield command, "\n".join(said)


def assert_says(said: str, printed: str, where: str) -> None:
    """What is printed is what was said, but for `...` and small differences of numbers."""
    words, wanted = said.split(), printed.split()
    assert _alike(words, wanted), f"{where} prints\n{printed}\nand it says\n{said}"


def _alike(words: list[str], wanted: list[str]) -> bool:
    """Whether words are those that are wanted; each piece between `...` is found in its order."""
    parts: list[list[str]] = [[]]
    for word in wanted:
        if word == "...":
            parts.append([])
        else:
            parts[-1].append(word)
    if len(parts) == 1:
        return _same(words, parts[0])
    first, *middle, last = parts
    if not _same(words[: len(first)], first):
        return False
    at = len(first)
    for part in middle:
        found = (k for k in range(at, len(words)) if _same(words[k : k + len(part)], part))
        at = next(found, len(words) + 1) + len(part)
    return at + len(last) <= len(words) and _same(words[len(words) - len(last) :], last)


def _same(words: list[str], wanted: list[str]) -> bool:
    return len(words) == len(wanted) and all(
        _same_word(*pair) for pair in zip(words, wanted, strict=True)
    )


def _same_word(word: str, wanted: str) -> bool:
    if word == wanted:
        return True
    word, wanted = word.rstrip(",;:"), wanted.rstrip(",;:")
    if not _NUMBER.match(word) or not _NUMBER.match(wanted):
        return False
    return abs(float(word) - float(wanted)) <= _MARGIN * abs(float(wanted))
