"""The commands that reproduce a recording or a result."""

from __future__ import annotations

import json
import shlex
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

from real_bench.controller_code.finding import find_controller
from real_bench.controller_code.source import is_installed
from real_bench.errors import ControllerError
from real_bench.lengths import TRIAL_STEPS
from real_bench.recording import Header
from real_bench.scoring.result import Setting
from real_bench.settings import dotted, settings_in_full

UNKNOWN = object()


def play_command(header: Header, steps: int, file: str) -> str:
    """The command that plays a recording again."""
    images = ["--images"] if header.images and header.condition.startswith("O") else []
    return _command(
        "intrinsic",
        *_run_options(
            header.controller, header.condition, header.objects, header.scene, header.seed
        ),
        *(["--steps", str(steps)]),
        *images,
        *_settings(header.controller, header.settings),
        *["--out", file],
    )


def scoring_command(
    setting: Setting, run: str | None, goals: str | None, file: str, learning: Sequence[str]
) -> str:
    """The command that tests again.

    Args:
        setting: of the result.
        run: the recording of the play, if there is one.
        goals: the goal set's file; None: the shipped one.
        file: the result.
        learning: the options that say how it learned from the recording, or played.
    """
    n_trials = len(setting.goal_numbers)
    length = setting.trial_steps
    options = [
        *_run_options(
            setting.controller, setting.condition, setting.objects, setting.scene, setting.seed
        ),
        *([] if run is None else ["--run", run, *learning]),
        *([] if goals is None else ["--goals", goals]),
        *([] if n_trials == setting.set_size else ["--trials", str(n_trials)]),
        *([] if length == TRIAL_STEPS else ["--trial-steps", str(length)]),
        *_settings(setting.controller, setting.settings),
        *["--out", file],
    ]
    at_once = setting.learned_from == "process"
    return _command("evaluate" if at_once else "extrinsic", *options)


def _run_options(controller: str, condition: str, objects: int, scene: str, seed: int) -> list[str]:
    named = {"controller": controller, "condition": condition, "objects": objects}
    return [
        part
        for name, value in {**named, "scene": scene, "seed": seed}.items()
        for part in (f"--{name}", str(value))
    ]


def _settings(controller: str, settings: Mapping[str, Any]) -> list[str]:
    """The settings that are not the controller's defaults; all if the defaults are unknown.

    Files are not trusted: no code is run just because a file names it.
    """
    defaults = {}
    if is_installed(controller):
        with suppress(ControllerError):
            defaults = dict(dotted(settings_in_full(find_controller(controller), controller, {})))
    return [
        part
        for name, value in dotted(settings)
        if defaults.get(name, UNKNOWN) != value
        for part in ("--set", f"{name}={json.dumps(value)}")
    ]


def _command(name: str, *arguments: str) -> str:
    return shlex.join(["realbench", name, *arguments])
