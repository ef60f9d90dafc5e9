"""The Python library: simulate designs, run jobs, ask about them.

.. code-block:: python

    import gaitswarm

    result = gaitswarm.optimize(controller="pi", scenarios="normal-fast", iterations=10)
    walk = gaitswarm.simulate(result.best.design, controller="pi", log=True)

    with gaitswarm.connect("http://127.0.0.1:8000") as jobs:
        job = jobs.submit(controller="pi", iterations=10)
        for event in jobs.follow(job.id):
            print(event)

A name is imported when it is first used, so that `import gaitswarm` takes no time.
"""

from __future__ import annotations

import ast
from pathlib import Path
from typing import Any, Final


def _modules() -> dict[str, str]:
    """Module of every public name, as type checkers read it from the stub."""
    stub = ast.parse(Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8"))
    return {
        name.name: str(statement.module)
        for statement in stub.body
        if isinstance(statement, ast.ImportFrom)
        for name in statement.names
    }


_MODULES: Final = _modules()

__all__ = ["__version__", *_MODULES]  # noqa: PLE0604 - names of the stub


def __getattr__(name: str) -> Any:
    if name == "__version__":
        found: Any = _version()
    elif name in _MODULES:
        from importlib import import_module

        found = getattr(import_module(_MODULES[name]), name)
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


def _version() -> str:
    """Of the installed package; a bare checkout has none."""
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("gaitswarm")
    except PackageNotFoundError:
        return "0+unknown"
