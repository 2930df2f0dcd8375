"""Run the real command in a real process."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

from real_bench.goal_sets import GoalSet, generate_goal_set
from real_bench.simulation import Scene

COMMAND = Path(sys.executable).with_name("realbench")
TOUCHES = (
    "import pathlib, contextlib",
    "with contextlib.suppress(OSError):",
    "    pathlib.Path(__file__).with_name('touched').touch()",
)
"""Lines that leave a trace in their folder, where they are let."""


def heed_ctrl_c() -> None:
    """In a new process, before its command: a background shell hands down an ignored SIGINT."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


def realbench(
    folder: Path, *arguments: str | Path, code: int = 0
) -> subprocess.CompletedProcess[str]:
    """Run realbench in a folder; fails the test unless it exits with ``code``."""
    done = subprocess.run(
        [str(COMMAND), *map(str, arguments)],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    assert done.returncode == code, done.stdout + done.stderr
    return done


def tiny_goals(scene: Scene, n_objects: int = 1, seed: int = 5) -> GoalSet:
    """Two 2D goals."""
    return generate_goal_set(scene, n_objects, seed, counts={"2D": 2})


def write_controller(path: Path, *body: str, before: str = "") -> None:
    """A controller like REAL-R, with these lines in its class, and a line before it."""
    lines = (before, "from real_bench.controllers.real_r import RealR", "class Mine(RealR):")
    path.write_text("\n".join([*lines, *(f"    {line}" for line in body), ""]))
