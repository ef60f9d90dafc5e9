"""A program for `LimitedProcesses` that exceeds limits on request."""

from __future__ import annotations

import os
import signal
import time

from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.limited_process import Document, serve


def answer(request: Document) -> Document:
    match request["do"]:
        case "wait":
            time.sleep(request.get("seconds", 60.0))
        case "compute":
            while True:
                pass
        case "fill":
            return {"length": len(bytearray(1 << 40))}
        case "crash":
            os.kill(os.getpid(), signal.SIGSEGV)
        case "chatter":
            print("not an answer", flush=True)  # noqa: T201
        case "write":
            with open(request["path"], "w") as file:  # noqa: PTH123
                file.write("something")
        case "refuse":
            raise SimulationInputError("field: no")
        case "fail":
            raise ZeroDivisionError("a bug")
    return {"pid": os.getpid(), "said": request.get("say")}


if __name__ == "__main__":
    serve(answer)
