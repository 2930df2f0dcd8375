"""Short recordings and made-up results that figures are drawn from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from real_bench.conditions import Condition
from real_bench.figures import (
    FigureData,
    FigureOptions,
    Play,
    Tested,
    play_labels,
    read_play,
    read_tested,
)
from real_bench.phases.intrinsic import IntrinsicPhase
from real_bench.scoring.result import Result
from real_bench.simulation import load_scene
from tests.scoring.bench import made

PUSHER = str(Path(__file__).parent / "pusher.py")
REST = str(Path(__file__).parents[1] / "real_x" / "rests.py")

FEW_STEPS: dict[str, Any] = {"vae": {"steps": 5}}
OPTIONS = FigureOptions(FEW_STEPS)


def record(
    out: Path,
    controller: str = PUSHER,
    condition: str = "OM",
    *,
    steps: int = 5000,
    objects: int = 1,
    images: bool | None = None,
    resume: bool = False,
    seed: int = 0,
    **settings: Any,
) -> Path:
    """Let a controller play in the scene builtin."""
    where = Condition.parse(condition), objects, load_scene("builtin")
    phase = IntrinsicPhase(controller, *where, steps, seed, out, images, settings)
    phase.run(lambda _: None, resume=resume)
    return out


def read(*paths: Path, options: FigureOptions = OPTIONS) -> tuple[Play, ...]:
    labels = play_labels(paths)
    return tuple(read_play(path, label, options) for path, label in zip(paths, labels, strict=True))


def only(material: FigureData, *names: str) -> FigureData:
    """The recordings of these files, without results."""
    return FigureData(tuple(play for play in material.plays if Path(play.file).stem in names))


@dataclass(frozen=True)
class Test:
    """What a made-up result is of."""

    __test__ = False

    controller: str = "real_ld"
    condition: str = "IM"
    run_steps: int = 15_000_000
    code: str = "2" * 64
    goals: str = "4" * 64
    run: str = "3" * 64
    n_goals: int | None = None


def made_up(test: Test, distances: Sequence[float], **settings: Any) -> Result:
    """A result whose goals were missed by these distances (m): half of them 2D, then the others."""
    half = -(-len(distances) // 2)
    classes = ["2D"] * half + [("2.5D", "3D")[goal % 2] for goal in range(half, len(distances))]
    return made(
        distances,
        classes=classes,
        condition=test.condition,
        controller=test.controller,
        controller_sha256=test.code,
        settings=settings,
        run_sha256=test.run,
        run_steps=test.run_steps,
        goals_sha256=test.goals,
        n_goals=test.n_goals or len(distances),
    )


def reread(folder: Path, *results: Result) -> tuple[Tested, ...]:
    """Results, written and read again."""
    read_again = []
    for number, result in enumerate(results):
        result.save(folder / f"result-{number}.json")
        read_again.append(read_tested(folder / f"result-{number}.json"))
    return tuple(read_again)
