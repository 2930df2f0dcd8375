"""Run the real command in a real process."""

from __future__ import annotations

import multiprocessing
import multiprocessing.forkserver
import os
import signal
import subprocess
import sys
import tempfile
import time
from functools import cache
from multiprocessing.context import ForkServerContext
from pathlib import Path

from real_bench.goal_sets import GoalSet, generate_goal_set
from real_bench.simulation import Scene
from tests.recording.bench import PATIENCE_S, wait_until

COMMAND = Path(sys.executable).with_name("realbench")
IMPORTED = [
    *("real_bench.cli", "real_bench.phases.plans", "real_bench.verification"),
    *("real_bench.experiments", "real_bench.competition", "real_bench.real_x", "real_bench.report"),
    *("matplotlib.figure", "matplotlib.backends.backend_agg", "matplotlib.backends.backend_svg"),
    *("av", "rich.progress", "scipy.stats", "torch", "tests.cli.warm"),
]
"""Most commands import these, and short ones do little else."""

ROOT = Path(__file__).parents[2]

TOUCHES = (
    "import pathlib, contextlib",
    "with contextlib.suppress(OSError):",
    "    pathlib.Path(__file__).with_name('touched').touch()",
)
"""Lines that leave a trace in their folder, where they are let."""


def heed_ctrl_c() -> None:
    """In a new process, before its command: a background shell hands down an ignored SIGINT."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


def realbench(folder: Path, *arguments: object, code: int = 0) -> subprocess.CompletedProcess[str]:
    """Run realbench in a folder; fails the test unless it exits with ``code``.

    Its process is a fork of one that has imported the package and knows the physics of this
    machine, so that a hundred commands find out once.
    """
    command = [str(COMMAND), *map(str, arguments)]
    with tempfile.TemporaryDirectory() as outputs:
        out, err = Path(outputs, "out"), Path(outputs, "err")
        process = _forks().Process(
            target=_called, args=(folder, command, dict(os.environ), _import_path(), out, err)
        )
        process.start()
        process.join(PATIENCE_S)
        if process.exitcode is None:
            process.kill()
            process.join()
        assert process.exitcode is not None
        done = subprocess.CompletedProcess(
            command, process.exitcode, out.read_text(), err.read_text()
        )
    assert done.returncode == code, done.stdout + done.stderr
    return done


def killed_at_work(folder: Path, *arguments: object, results: Path, pause_s: float) -> bool:
    """Kill realbench a moment after a recording or a result has come; False: it ended before."""

    def n_files() -> int:
        return len([*results.rglob("[!.]*.h5"), *results.rglob("*seed*.json")])

    before, nothing = n_files(), subprocess.DEVNULL
    command = [str(COMMAND), *map(str, arguments)]
    with subprocess.Popen(command, cwd=folder, stdout=nothing, stderr=nothing) as process:
        wait_until(lambda: n_files() > before or process.poll() is not None)
        time.sleep(pause_s)
        at_work = process.poll() is None
        process.kill()
    return at_work


@cache
def _forks() -> ForkServerContext:
    """The server of forks, started where it finds our modules."""
    forks = multiprocessing.get_context("forkserver")
    forks.set_forkserver_preload(IMPORTED)
    here = Path.cwd()
    os.chdir(ROOT)
    try:
        multiprocessing.forkserver.ensure_running()
    finally:
        os.chdir(here)
    return forks


def _called(
    folder: Path, command: list[str], environment: dict[str, str], path: list[str], *outputs: Path
) -> None:
    """In the new process: what the script ``realbench`` does, where a shell would call it."""
    from real_bench.cli import main

    for number, output in enumerate(outputs, start=1):
        file = os.open(output, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
        os.dup2(file, number)
        os.close(file)
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    sys.argv, sys.path[:] = command, path
    main()


def _import_path() -> list[str]:
    """Where a script imports from: without what the test runner adds, with PYTHONPATH."""
    own = [folder for folder in os.environ.get("PYTHONPATH", "").split(os.pathsep) if folder]
    return [str(COMMAND.parent), *own, *_installed_path()]


@cache
def _installed_path() -> list[str]:
    show = f"import sys; print(*sys.path[1:], sep={os.pathsep!r})"
    shown = subprocess.run(
        [sys.executable, "-E", "-c", show], capture_output=True, text=True, check=True
    )
    return shown.stdout.strip().split(os.pathsep)


def tiny_goals(scene: Scene, n_objects: int = 1, seed: int = 5, n_goals: int = 2) -> GoalSet:
    """Two 2D goals, or as many as are asked for."""
    return generate_goal_set(scene, n_objects, seed, counts={"2D": n_goals})


def write_controller(path: Path, *body: str, before: str = "") -> None:
    """A controller like REAL-R, with these lines in its class, and a line before it."""
    lines = (before, "from real_bench.controllers.real_r import RealR", "class Mine(RealR):")
    path.write_text("\n".join([*lines, *(f"    {line}" for line in body), ""]))
