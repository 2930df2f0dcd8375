"""What isolation costs, as a ratio in one run: these depend little on the machine.

    python evaluation/bench_isolation.py [--rounds 5] [--steps 20000]

Each round plays with the same controller in our own process and in isolation, one right after the
other: REAL-R, which decides on whole actions, without and with images, and a controller that is
called at every step. Only the playing is timed, from the first action's end to the last one's.
"""

from __future__ import annotations

import statistics
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click
import numpy as np
from rich.console import Console
from rich.table import Table

from real_bench.actions import ACTION_STEPS
from real_bench.conditions import Condition
from real_bench.controller import Controller
from real_bench.phases.intrinsic import IntrinsicPhase
from real_bench.phases.local import LocalBackend
from real_bench.phases.proxy import ControllerBackend
from real_bench.sandbox import SandboxBackend
from real_bench.simulation import Scene, load_scene

MEASURED = {
    "whole actions, OM (REAL-R)": ("real_r", "OM"),
    "whole actions, IM (REAL-R)": ("real_r", "IM"),
    "one call a step, OM": (f"{__file__}:Pushes", "OM"),
    "one call a step, IJ": (f"{__file__}:Moves", "IJ"),
}


class Pushes(Controller):
    """Random macros, one call a step."""

    n_calls = 0

    def seed(self, seed: int) -> None:
        """Where its randomness comes from."""
        self.random = np.random.default_rng(seed)

    def step(self, observation: Mapping[str, Any], reward: float, done: bool) -> dict[str, Any]:
        """The same macro for 1000 steps."""
        if self.n_calls % ACTION_STEPS == 0:
            self.macro = self.random.uniform([-0.25, -0.5], [0.05, 0.5], (2, 2))
        self.n_calls += 1
        return {"macro_action": self.macro, "render": False}


class Moves(Pushes):
    """Random joints, one call a step."""

    def step(self, observation: Mapping[str, Any], reward: float, done: bool) -> dict[str, Any]:
        """Other joints at every 100th step."""
        if self.n_calls % 100 == 0:
            self.joints = self.random.uniform(-0.5, 0.5, 9)
        self.n_calls += 1
        return {"joint_command": self.joints, "render": False}


def seconds(
    controller: str, condition: str, steps: int, seed: int, scene: Scene, backend: ControllerBackend
) -> float:
    """How long free play takes; its first 1000 steps warm up."""
    moments: list[float] = []
    with tempfile.TemporaryDirectory() as folder:
        phase = IntrinsicPhase(
            controller=controller,
            condition=Condition.parse(condition),
            objects=1,
            scene=scene,
            steps=steps + ACTION_STEPS,
            seed=seed,
            out=Path(folder) / "run.h5",
            backend=backend,
        )
        phase.run(lambda progress: moments.append(time.perf_counter())).close()
    return moments[-1] - moments[0]


@click.command()
@click.option("--scene", default="official", show_default=True)
@click.option("--steps", default=20000, show_default=True)
@click.option("--rounds", default=5, show_default=True)
def main(scene: str, steps: int, rounds: int) -> None:
    """Measure and print."""
    loaded, isolated = load_scene(scene), SandboxBackend()
    table = Table(title=f"isolated / in our process, {rounds} rounds of {steps:,} steps, in turn")
    for heading in ("what", "us/step", "isolated", "median ratio", "lowest", "highest"):
        table.add_column(heading, justify="left" if heading == "what" else "right")
    for name, (controller, condition) in MEASURED.items():
        here: list[float] = []
        there: list[float] = []
        for seed in range(rounds):
            for times, backend in ((here, LocalBackend()), (there, isolated)):
                times.append(seconds(controller, condition, steps, seed, loaded, backend))
        ratios = [two / one for one, two in zip(here, there, strict=True)]
        table.add_row(
            name,
            *(f"{statistics.median(times) / steps * 1e6:.0f}" for times in (here, there)),
            *(f"{number:.3f}" for number in (statistics.median(ratios), min(ratios), max(ratios))),
        )
    Console().print(table, f"controllers were {isolated.support.describe()}")


if __name__ == "__main__":
    main()
