"""Compare speeds in one run, and print ratios: these depend little on the machine.

    python evaluation/bench.py [--official VENV] [--macros 40] [--rounds 5]

Each round measures, one right after the other, on the same random macros:

* ours: steps/s of the whole intrinsic phase, as `realbench intrinsic` runs it in condition OM;
* bare: the rate of nothing but `stepSimulation` calls within the same motion;
* official: with --official, the official package's rate through its own evaluation.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from unittest import mock

import click
from rich.console import Console
from rich.table import Table

from real_bench.actions import ACTION_STEPS
from real_bench.conditions import Condition
from real_bench.phases.intrinsic import IntrinsicPhase
from real_bench.simulation import load_scene
from real_bench.simulation.bullet import pybullet

CONDITION = Condition.parse("OM")


def play(n_macros: int, scene: str, seed: int) -> float:
    """Seconds that an intrinsic phase of so many macros takes, from its first step to its last."""
    moments: list[float] = []
    with tempfile.TemporaryDirectory() as folder:
        phase = IntrinsicPhase(
            controller="real_r",
            condition=CONDITION,
            objects=1,
            scene=load_scene(scene),
            steps=n_macros * ACTION_STEPS,
            seed=seed,
            out=Path(folder) / "run.h5",
        )
        phase.run(lambda progress: moments.append(time.perf_counter()))
    return moments[-1] - moments[0]


def ours(n_macros: int, scene: str, seed: int) -> float:
    """Our steps a second; the first macro warms up."""
    return n_macros * ACTION_STEPS / play(n_macros + 1, scene, seed)


def bare(n_macros: int, scene: str, seed: int) -> float:
    """Steps a second if a phase were nothing but its `stepSimulation` calls."""
    seconds = 0.0
    step: Callable[[int], None] = pybullet.stepSimulation
    clock = time.perf_counter

    def timed_step(client: int) -> None:
        nonlocal seconds
        began = clock()
        step(client)
        seconds += clock() - began

    with mock.patch.object(pybullet, "stepSimulation", timed_step):
        play(n_macros + 1, scene, seed)
    return (n_macros + 1) * ACTION_STEPS / seconds


def official(n_macros: int, venv: Path) -> float:
    """The official package's steps a second."""
    command = [venv / "bin" / "python", Path(__file__).with_name("official_rate.py")]
    done = subprocess.run(
        [*map(str, command), str(n_macros * ACTION_STEPS)],
        capture_output=True,
        text=True,
        check=False,
    )
    lines = [line for line in done.stdout.splitlines() if line.startswith("rate ")]
    if not lines:
        sys.exit(f"the official package did not run:\n{done.stderr[-2000:]}")
    return float(lines[-1].split()[1])


@click.command()
@click.option("--official", "venv", type=click.Path(path_type=Path, exists=True))
@click.option("--scene", default="official", show_default=True)
@click.option("--macros", default=40, show_default=True)
@click.option("--rounds", default=5, show_default=True)
def main(venv: Path | None, scene: str, macros: int, rounds: int) -> None:
    """Measure and print."""
    measures: dict[str, Callable[[int], float]] = {
        "ours: intrinsic phase, REAL-R, OM": lambda seed: ours(macros, scene, seed),
        "bare stepSimulation, same motion": lambda seed: bare(macros, scene, seed),
    }
    if venv is not None:
        measures["official package, its own evaluation"] = lambda seed: official(macros, venv)
    rates: dict[str, list[float]] = {name: [] for name in measures}
    for seed in range(rounds):
        for name, measure in measures.items():
            rates[name].append(measure(seed))
    Console().print(_table(rates, rounds, macros))


def _table(rates: dict[str, list[float]], rounds: int, macros: int) -> Table:
    table = Table(title=f"median of {rounds} rounds of {macros} macros, in turn")
    for heading in ("what", "steps/s", "ours / this", "lowest", "highest"):
        table.add_column(heading, justify="left" if heading == "what" else "right")
    first = next(iter(rates.values()))
    for name, values in rates.items():
        ratios = [mine / theirs for mine, theirs in zip(first, values, strict=True)]
        table.add_row(
            name,
            f"{statistics.median(values):,.0f}",
            f"{statistics.median(ratios):.3f}",
            f"{min(ratios):.3f}",
            f"{max(ratios):.3f}",
        )
    return table


if __name__ == "__main__":
    main()
