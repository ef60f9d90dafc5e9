"""Types of `AsyncJobs`, from the signatures of `Jobs`: gaitswarm/jobs/asynchronous.pyi.

`python scripts/async_stub.py` writes the file; tests/library/test_public_names.py compares it.
"""

from __future__ import annotations

import ast
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

FOLDER = Path(__file__).parent.parent / "gaitswarm" / "jobs"
STUB = FOLDER / "asynchronous.pyi"

_BEGIN = """
class AsyncJobs:
    def __init__(self, connect: Callable[[], Jobs], url: str) -> None: ...
    @property
    def url(self) -> str: ...
    async def __aenter__(self) -> Self: ...
    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None: ...
"""


def stub() -> str:
    """Return the text of the stub, not yet formatted."""
    base, database = (_module(FOLDER / name) for name in ("base.py", "database.py"))
    methods = list(_methods(base, "Jobs"))
    (run,) = (method for method in _methods(database, "DatabaseJobs") if "def run(" in method)
    run = run.replace("job: str | Claim", "job_id: str")
    run = run.replace(", stop: threading.Event | None=None", "")
    body = _indented(_BEGIN, *methods, "", "class AsyncDatabaseJobs(AsyncJobs):", run)
    names = {node.id for node in ast.walk(ast.parse(body)) if isinstance(node, ast.Name)}
    imports = _imports(base) | _imports(database)
    imports |= {"AsyncIterator": "collections.abc"}
    imports |= dict.fromkeys(("Jobs", "JobEvent", "Priority", "Runs"), "gaitswarm.jobs.base")
    modules = defaultdict(list)
    for name in sorted(names & imports.keys()):
        modules[imports[name]].append(name)
    lines = [f"from {module} import {', '.join(found)}" for module, found in modules.items()]
    return "\n".join(["import os", *sorted(lines), body])


class _Plain(ast.NodeTransformer):
    """Drops limits of arguments: Annotated[int, Field(ge=0)] -> int."""

    def visit_Subscript(self, node: ast.Subscript) -> ast.AST:
        if isinstance(node.slice, ast.Tuple) and ast.unparse(node.value) == "Annotated":
            return node.slice.elts[0]
        return self.generic_visit(node)


def _module(path: Path) -> ast.Module:
    module: ast.Module = _Plain().visit(ast.parse(path.read_text(encoding="utf-8")))
    return module


def _indented(begin: str, *lines: str) -> str:
    return begin + "\n".join(f"    {line}" if "def " in line else line for line in lines) + "\n"


def _imports(module: ast.Module) -> dict[str, str]:
    """Return the module of every imported name."""
    return {
        alias.name: str(node.module)
        for node in ast.walk(module)
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }


def _methods(module: ast.Module, name: str) -> Iterator[str]:
    """Yield the signatures of a class's public methods, as coroutine functions."""
    (found,) = (c for c in module.body if isinstance(c, ast.ClassDef) and c.name == name)
    for method in found.body:
        if not isinstance(method, ast.FunctionDef) or method.name.startswith("_"):
            continue
        if any(ast.unparse(decorator) == "property" for decorator in method.decorator_list):
            continue
        result = ast.unparse(method.returns) if method.returns else "None"
        arguments = method.args
        for values in (arguments.defaults, arguments.kw_defaults):
            # A stub has simple defaults only.
            values[:] = [
                v if v is None or isinstance(v, ast.Constant) else ast.Constant(...) for v in values
            ]
        iterates = result.startswith("Iterator[")
        head, result = ("def", f"Async{result}") if iterates else ("async def", result)
        yield f"{head} {method.name}({ast.unparse(arguments)}) -> {result}: ..."


def main() -> None:
    STUB.write_text(stub(), encoding="utf-8")
    ruff = [sys.executable, "-m", "ruff"]
    subprocess.run([*ruff, "check", "-q", "--fix", "--select", "I", str(STUB)], check=True)
    subprocess.run([*ruff, "format", "-q", str(STUB)], check=True)


if __name__ == "__main__":
    main()
