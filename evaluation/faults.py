"""Kill every phase at random moments and resume it: nothing may be lost or counted twice.

python evaluation/faults.py --kills 100
"""

from __future__ import annotations

import json
import random
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
from rich.console import Console
from rich.table import Table

from real_bench.conditions import Condition
from real_bench.goal_sets import generate_goal_set, save_goal_set
from real_bench.recording import Experience
from real_bench.scoring.result import load_result
from real_bench.simulation import load_scene

REALBENCH = str(Path(sys.executable).with_name("realbench"))
STEPS, GOALS = 120_000, 12
SPEC = {
    "scene": "builtin",
    "steps": 20_000,
    "trial_steps": 5_000,
    "repeats": 2,
    "goals": {"few": "goals.npy"},
    "plays": {"random": {"controller": "real_r", "condition": "OM"}},
    "cells": [
        {"controller": "real_r", "condition": "OM", "play": "random"},
        {"controller": "real_d", "condition": "OM", "play": "random"},
    ],
}


@dataclass
class Count:
    """What came of killing one kind of run.

    Attributes:
        phase: what was killed.
        things: what is counted.
        kills, begun: how often it was killed while it ran, and begun.
        lost, twice, other: how many things are missing, there twice, or not as they were in the
            run that nobody killed.
    """

    phase: str
    things: str
    kills: int = 0
    begun: int = 0
    lost: int = 0
    twice: int = 0
    other: int = 0

    def kill(self, command: list[str], kills: int, moments: Callable[[], float]) -> None:
        """Kill a command so many times, each time going on; then let it end."""
        for _ in range(kills):
            process = subprocess.Popen(
                command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
            )
            self.begun += 1
            try:
                process.wait(moments())
                break  # it has come to its end before it could be killed
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
                self.kills += 1
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


def play(folder: Path, kills: int, moments: random.Random) -> Count:
    """Kill intrinsic phases; the actions of a random controller must be those of one not killed."""
    command = [REALBENCH, "intrinsic", "--controller", "real_r", "--condition", "OM", "--images"]
    command += ["--scene", "builtin", "--steps", str(STEPS), "--out"]
    subprocess.run([*command, f"{folder}/whole.h5"], check=True, capture_output=True)
    whole, count = actions(folder / "whole.h5"), Count("intrinsic", "triplets")
    while count.kills < kills:
        out = folder / f"killed-{count.kills}.h5"
        asked = min(10, kills - count.kills)
        count.kill([*command, str(out), "--resume"], asked, lambda: moments.uniform(0.3, 6))
        found = actions(out)
        count.lost += max(len(whole) - len(found), 0)
        count.twice += len(found) - len(set(found))
        count.other += sum(a != b for a, b in zip(whole, found, strict=False))
    return count


def actions(path: Path) -> list[bytes]:
    """The commands of every triplet, in order."""
    experience = Experience(path, Condition.parse("OM"))
    return [experience.action(index).commands.tobytes() for index in range(len(experience))]


def test(folder: Path, kills: int, moments: random.Random) -> Count:
    """Kill extrinsic phases; their trials must be those of one not killed."""
    command = [REALBENCH, "extrinsic", "--controller", "real_r", "--condition", "OM"]
    command += ["--scene", "builtin", "--goals", f"{folder}/goals.npy", "--out"]
    subprocess.run([*command, f"{folder}/whole.json"], check=True, capture_output=True)
    whole, count = load_result(folder / "whole.json").trials, Count("extrinsic", "goals")
    while count.kills < kills:
        out = folder / f"killed-{count.kills}.json"
        asked = min(8, kills - count.kills)
        count.kill([*command, str(out), "--resume"], asked, lambda: moments.uniform(0.3, 6))
        found = load_result(out).trials
        goals = [trial.goal for trial in found]
        count.lost += len({trial.goal for trial in whole} - set(goals))
        count.twice += len(goals) - len(set(goals))
        count.other += sum(a != b for a, b in zip(whole, found, strict=False))
    return count


def table(folder: Path, kills: int, moments: random.Random) -> Count:
    """Kill tables; every number must be that of one not killed."""
    whole, count = read_table(folder, "whole"), Count("table", "results")
    while count.kills < kills:
        name = f"killed-{count.kills}"
        command = [REALBENCH, "table", write_spec(folder, name)]
        asked = min(5, kills - count.kills)
        count.kill(command, asked, lambda: moments.uniform(1, 10))
        for a, b in zip(whole, read_table(folder, name), strict=True):
            count.lost += len(a["files"]) - len(b["files"])
            count.twice += len(b["files"]) - len(set(b["files"]))
            count.other += a != b
    return count


def write_spec(folder: Path, name: str) -> str:
    """An experiment with results of its own; returns its file."""
    path = folder / f"{name}.yaml"
    path.write_text(json.dumps({**SPEC, "title": "killed", "results": name}))
    return str(path)


def read_table(folder: Path, name: str) -> list[dict[str, Any]]:
    """The table's rows, made where they are not yet."""
    command = [REALBENCH, "table", write_spec(folder, name), "--json"]
    done = subprocess.run(command, check=True, capture_output=True)
    rows: list[dict[str, Any]] = json.loads(done.stdout)["rows"]
    return rows


@click.command()
@click.option("--kills", type=click.IntRange(min=3), default=100, show_default=True)
@click.option("--seed", type=int, default=0, show_default=True)
def main(kills: int, seed: int) -> None:
    """Kill intrinsic, extrinsic and table, so many times in all, and count."""
    began, generator = time.monotonic(), random.Random(seed)
    shares = {play: kills * 45 // 100, test: kills * 35 // 100}
    shares[table] = kills - sum(shares.values())
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        goals = generate_goal_set(load_scene("builtin"), 1, 3, counts={"2D": GOALS})
        save_goal_set(goals, folder / "goals.npy")
        counts = [run(folder, share, generator) for run, share in shares.items()]
    shown = Table(title=f"SIGKILL at random moments, {time.monotonic() - began:.0f} s")
    for heading in ("phase", "kills", "runs begun", "of", "lost", "counted twice", "other"):
        shown.add_column(heading)
    for count in counts:
        totals = (count.kills, count.begun, count.things, count.lost, count.twice, count.other)
        shown.add_row(count.phase, *map(str, totals))
    Console(width=110).print(shown)
    sys.exit(any(count.lost or count.twice or count.other for count in counts))


if __name__ == "__main__":
    main()
