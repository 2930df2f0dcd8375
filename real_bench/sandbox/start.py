"""What the child runs first: give up what a controller must not have, then serve.

A script, run by its path. Until the rights are given up it uses only the standard library:
libraries like numpy start threads, which would keep their rights.
"""

import ctypes
import json
import os
import platform
import resource
import runpy
import signal
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

_SET_PARENT_DEATH_SIGNAL = 1


def main() -> None:
    """Run by the parent with one argument, JSON: see ``support.py``."""
    orders = json.loads(sys.argv[1])
    _die_with_parent(orders["parent"])
    _limit(orders["memory_bytes"], orders["file_bytes"])
    if orders["reach"] is not None:
        _load_part("landlock")["restrict"](**orders["reach"])
    if orders["seccomp"]:
        _load_part("seccomp")["restrict"]()
    del sys.argv[1:]
    sys.path += orders["import_from"]
    _enter_workplace(orders["workplace"])

    from real_bench.sandbox.child import serve

    serve(orders["channel"])


def _load_part(name: str) -> dict[str, Any]:
    return runpy.run_path(str(Path(__file__).with_name(f"{name}.py")))


def _enter_workplace(workplace: "dict[str, Any]") -> None:
    from real_bench.sandbox import working_directory

    paths = {name: [Path(path) for path in workplace[name]] for name in ("own", "hidden")}
    folder = workplace["folder"]
    try:
        working_directory.make(Path(workplace["place"]), folder and Path(folder), **paths)
    except OSError as error:
        sys.exit(f"its folder cannot be copied into its working directory: {error}")


def _die_with_parent(parent: "int | None") -> None:
    """Die with the parent, however it dies; inside a sandbox, the sandbox ensures that."""
    if parent is None or platform.system() != "Linux":
        return
    ctypes.CDLL(None).prctl(_SET_PARENT_DEATH_SIGNAL, signal.SIGKILL, 0, 0, 0)
    if os.getppid() != parent:
        os._exit(1)


def _limit(memory_bytes: int, file_bytes: int) -> None:
    limits = {"AS": memory_bytes, "FSIZE": file_bytes, "CORE": 0, "NOFILE": 256}
    for name, limit in limits.items():
        with suppress(ValueError, OSError):  # a system may lack one, or be stricter already
            resource.setrlimit(getattr(resource, f"RLIMIT_{name}"), (limit, limit))


if __name__ == "__main__":
    main()
