"""What is in a file, as facts by name."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from real_bench.cli.printing import say
from real_bench.settings import dotted

if TYPE_CHECKING:
    from real_bench.recording import Recording

WIDTH = 100


def describe_recording(path: Path) -> dict[str, Any]:
    """The facts of a recording."""
    from real_bench.recording import Recording

    with Recording(path) as recording:
        header = recording.header
        n_triplets = len(recording.transitions)
        return {
            "file": str(path),
            "megabytes": round(path.stat().st_size / 1e6, 3),
            "triplets": n_triplets,
            "steps": recording.n_steps,
            "steps_asked": recording.total_steps,
            "cut_at_steps": recording.cuts,
            "code_changed_at_steps": recording.code_changes,
            "share_of_actions_that_moved_an_object": (
                round(recording.share_moved(), 4) if n_triplets else None
            ),
            "abstraction_levels_below_1_cm": fine_levels(recording) if n_triplets else None,
            "images": recording.n_images or 0,
            **header.model_dump(mode="json", exclude={"images", "scene_source"}),
        }


def fine_levels(recording: Recording) -> dict[str, int]:
    """How many of the 200 levels of Dynamic Abstraction have a threshold below 1 cm, by variable.

    See the paper, section Results.
    """
    from real_bench.analysis import levels_below, planar
    from real_bench.real_x import DynamicAbstraction
    from real_bench.recording import MOVED_M

    rows, positions = recording.transitions, recording.object_poses[:, :, :3]
    triplets = planar(positions, rows["precondition"], rows["outcome"])
    below = levels_below(DynamicAbstraction.learn(triplets), MOVED_M)
    names = [f"{name} {axis}" for name in recording.header.object_names for axis in "xy"]
    return dict(zip(names, below.tolist(), strict=True))


def describe_goals(path: Path) -> dict[str, Any]:
    """The facts of a goal set."""
    from real_bench.goal_sets import load_goal_set

    goal_set = load_goal_set(path)
    return {
        "file": str(path),
        "megabytes": round(path.stat().st_size / 1e6, 3),
        "goals": len(goal_set),
        "by_class": goal_set.counts,
        "object_names": list(goal_set.object_names),
        "scene": goal_set.scene,
        "scene_sha256": goal_set.scene_sha256,
        "generator": goal_set.generator,
        "seed": goal_set.seed,
        "sha256": goal_set.sha256,
    }


def describe_result(path: Path) -> dict[str, Any]:
    """The facts of a result."""
    from real_bench.scoring.result import load_result

    result = load_result(path)
    return {
        "file": str(path),
        "score": result.score if result.trials else None,
        "trials": f"{len(result.trials)} of {len(result.setting.goal_numbers)}",
        "goals_tested": result.share,
        "complete": result.is_complete,
        "can_be_verified": result.keeps_commands,
        **result.setting.model_dump(mode="json"),
    }


def describe_experiment(path: Path) -> dict[str, Any]:
    """The facts of an experiment."""
    from real_bench.experiments import read_spec

    spec = read_spec(path)
    return {
        "file": str(path),
        "title": spec.title,
        "results": str(spec.results_folder),
        "scene": spec.scene,
        "steps": spec.steps,
        "goals": list(spec.goals),
        "repeats": {cell.name: len(spec.seeds(cell)) for cell in spec.cells},
    }


def print_facts(facts: dict[str, Any]) -> None:
    """Print facts for a person, one below the other."""
    column = max(map(len, facts)) + 2
    for name, value in facts.items():
        label = f"{name.replace('_', ' '):<{column}}"
        say(
            textwrap.fill(
                _in_words(name, value),
                WIDTH,
                initial_indent=label,
                subsequent_indent=" " * column,
                break_long_words=False,
                break_on_hyphens=False,
            )
        )


def _in_words(name: str, value: Any) -> str:
    if name.startswith("share") and value is not None:
        return f"{value:.1%}"
    if isinstance(value, int) and not isinstance(value, bool) and "seed" not in name:
        return f"{value:,}"
    return _plain(value)


def _plain(value: Any) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{name}={_plain(item)}" for name, item in dotted(value)) or "none"
    if isinstance(value, list | tuple):
        return _run(value) or ", ".join(map(_plain, value)) or "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if value is None:
        return "none"
    return f"{value:.4g}" if isinstance(value, float) else str(value) or "none"


def _run(values: Sequence[Any]) -> str:
    """``0 to 49`` for so many numbers in a row; empty for anything else."""
    if len(values) < 3 or not all(type(value) is int for value in values):
        return ""
    first, last = values[0], values[-1]
    return f"{first} to {last}" if list(values) == list(range(first, last + 1)) else ""
