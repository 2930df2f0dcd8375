"""How far the files of an experiment have come, and whether they are what it says."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Literal

from real_bench.errors import ControllerError, ExperimentError
from real_bench.experiments.tasks import PlayTask, ScoringTask, Task
from real_bench.naming import without_folder
from real_bench.scoring.result import Result, load_result
from real_bench.settings import as_validated, merged
from real_bench.source import ControllerSource, is_code_of, is_installed


@dataclass(frozen=True)
class State:
    """How far a task has come.

    Attributes:
        reached: whether its file is there, and whole.
        misfits: what of the file is not as the task says.
        result: what a test's file holds.
    """

    reached: Literal["missing", "unfinished", "done"]
    misfits: tuple[str, ...] = ()
    result: Result | None = None


def state_of(task: Task) -> State:
    """How far a task has come; reads its file."""
    if not task.out.exists():
        return State("missing")
    if isinstance(task, PlayTask):
        return _state_of_play(task)
    result = load_result(task.out)
    misfits = tuple(_misfits(task, result))
    done = len(result.trials) == task.n_goals
    return State("done" if done else "unfinished", misfits, result)


def not_of_this(task: Task, reasons: Sequence[str]) -> str:
    """What is told of a file that is not as its task says."""
    return f"{task.out.name} is not of this experiment: {'; '.join(reasons)}"


def refusal(wrong: Sequence[str]) -> ExperimentError:
    """The error for files that are not of the experiment, and what to do about them."""
    return ExperimentError(f"{in_short(wrong)}. Move them away, or let --overwrite replace them")


def in_short(reasons: Sequence[str], most: int = 3) -> str:
    """The first few reasons, and how many more there are."""
    more = f" (and {len(reasons) - most} more)" if len(reasons) > most else ""
    return f"{'. '.join(reasons[:most])}{more}"


def _misfits(task: ScoringTask, result: Result) -> list[str]:
    """What of a result is not as the task says."""
    from real_bench.files import file_sha256

    setting = result.setting
    names = ("condition", "objects", "seed", "trial_steps", "run_steps")
    reasons = _differences(
        {"scene": setting.scene, **{name: getattr(setting, name) for name in names}},
        {"scene": task.scene_name, **{name: getattr(task, name) for name in names}},
    )
    # a part of the goals is no misfit: the test goes on
    if setting.n_goals not in (None, task.n_goals) or setting.set_size > task.n_goals:
        reasons.append(f"{setting.set_size} goals, not {task.n_goals}")
    reasons += _controller_misfits(task, setting.controller, setting.controller_sha256)
    reasons += _setting_misfits(task, setting.settings)
    if task.goals_sha256 not in ("", setting.goals_sha256):
        reasons.append(f"other goals than {task.goals.name}")
    if task.run and task.run.exists() and file_sha256(task.run) != setting.run_sha256:
        reasons.append(f"another recording than {task.run.name}")
    return reasons


def _state_of_play(task: PlayTask) -> State:
    from real_bench.recording import Recording

    with Recording(task.out) as recording:
        header, ended = recording.header, recording.ended
        # one that was killed before its first action does not know yet how long it is to be
        steps = recording.total_steps if recording.n_steps else task.steps
    names = ("condition", "objects", "seed")
    reasons = _differences(
        {"scene": header.scene, "steps": steps, **{name: getattr(header, name) for name in names}},
        {
            "scene": task.scene_name,
            "steps": task.steps,
            **{name: getattr(task, name) for name in names},
        },
    )
    if task.images and not header.images:
        reasons.append("no images")
    reasons += _controller_misfits(task, header.controller, header.controller_sha256)
    reasons += _setting_misfits(task, header.settings)
    return State("done" if ended else "unfinished", tuple(reasons))


def _differences(found: Mapping[str, Any], asked: Mapping[str, Any]) -> list[str]:
    return [
        f"{name.replace('_', ' ')} {found[name]}, not {asked[name]}"
        for name in asked
        if found[name] != asked[name]
    ]


def _controller_misfits(task: Task, named: str, sha256: str) -> list[str]:
    """A file is told by its name and content, for it may have come from another folder."""
    if without_folder(named) != without_folder(task.controller):
        return _differences({"controller": named}, {"controller": task.controller})
    source = ControllerSource.of(task.controller)
    if source.file is not None and not is_code_of(source, sha256):
        return [f"{source.file.name}, or what lies beside it, as it was before it was changed"]
    return []


def _setting_misfits(task: Task, found: Mapping[str, Any]) -> list[str]:
    """What is asked for must be so; where nothing is asked, defaults may have changed."""
    asked, found = (json.loads(json.dumps(values)) for values in (task.settings, found))
    if merged(found, asked) != found:
        with suppress(ControllerError):  # of one that is not here
            # "50" may be 50 to it; who only looks runs no stranger's code outside walls
            walled = task.model_copy(update={"isolate": not is_installed(task.controller)})
            asked = as_validated(walled.settings_in_full(), asked)
    return [] if merged(found, asked) == found else [f"settings {found}, not {asked}"]
