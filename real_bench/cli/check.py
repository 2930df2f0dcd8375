"""``realbench check``."""

from __future__ import annotations

import contextlib
import json
import shlex
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from real_bench.cli import options
from real_bench.cli.printing import say, warnings_only

if TYPE_CHECKING:
    from real_bench.compat.options import OfficialOptions
    from real_bench.phases.checking import Finding
    from real_bench.phases.proxy import ControllerBackend, Identity

EPILOG = """\b
Example:
  realbench check my_controller.py
  realbench check submission/mine.py --condition IM --objects 2
"""

FAILED = 1
SCENE = "builtin"
"""It needs no download."""


@click.command(epilog=EPILOG)
@click.argument("controller")
@click.option(
    "--condition",
    metavar="XY",
    help="OM, IM, IJ, OJ, OC or IC. [default: from its options.yml, else the first that works]",
)
@options.objects_option
@options.scene_option
@options.settings_option
@options.set_option
@click.option("--isolated-only", is_flag=True, help="Never load its code in this process.")
@options.json_option
def check(
    controller: str,
    condition: str | None,
    objects: int | None,
    scene: str | None,
    settings_file: Path | None,
    assignments: tuple[str, ...],
    isolated_only: bool,
    as_json: bool,
) -> None:
    """Check quickly whether a controller works, before hours of play.

    Shows which class runs, and whether it loads, plays a few steps (in scene builtin if none is
    given), can be copied for each goal, hands over its state unchanged, and learns from such a play
    and tries a goal: in this process and isolated. Reads the options file of a starter kit, and
    prints the commands to use.
    """
    from real_bench.compat.options import official_options
    from real_bench.controller_code.source import ControllerSource
    from real_bench.phases.local import LocalBackend
    from real_bench.sandbox import SandboxBackend
    from real_bench.sandbox.visible_files import visible_files
    from real_bench.settings import read_settings

    source = ControllerSource.of(controller)
    told = official_options(source.place if source.file else Path())
    told = replace(told, objects=objects or told.objects)
    backends: dict[str, ControllerBackend] = {} if isolated_only else {"here": LocalBackend()}
    backends["isolated"] = SandboxBackend()
    settings = read_settings(settings_file, assignments)
    tried_condition = condition or told.condition
    if tried_condition is None and source.submission is not None:
        tried_condition = source.submission.condition
    found = {}
    for name, backend in backends.items():
        with contextlib.redirect_stdout(sys.stderr), warnings_only():  # stdout is for results
            tried_condition, found[name] = _check_conditions(
                controller, tried_condition, told.objects or 1, scene or SCENE, settings, backend
            )
    good = all(finding.good for findings in found.values() for finding in findings)
    commands = []
    if good and tried_condition:
        identity = next(iter(backends.values())).identity(controller, settings)
        subject = ["--controller", controller, "--condition", tried_condition]
        subject += ["--scene", scene] if scene else []
        subject += ["--settings", str(settings_file)] if settings_file else []
        subject += [word for value in assignments for word in ("--set", value)]
        commands = [shlex.join(words) for words in _commands(subject, identity, told)]
    if as_json:
        facts = {name: [asdict(one) for one in findings] for name, findings in found.items()}
        click.echo(json.dumps({"good": good, **facts, "commands": commands}))
    else:
        _show(found, visible_files(source).hidden_names(), commands)
    if not good:
        sys.exit(FAILED)


def _check_conditions(
    controller: str,
    condition: str | None,
    objects: int,
    scene: str,
    settings: dict[str, Any],
    backend: ControllerBackend,
) -> tuple[str, list[Finding]]:
    """The findings in a condition, or in the first one that the controller plays in."""
    from real_bench.conditions import CONDITION_NAMES, Condition
    from real_bench.goal_sets import shipped_sizes
    from real_bench.phases.checking import ControllerCheck, Finding
    from real_bench.simulation import load_scene

    has_goals = bool(shipped_sizes(objects, scene))
    tried = {}
    for name in (condition,) if condition else CONDITION_NAMES:
        one = ControllerCheck(
            controller,
            Condition.parse(name),
            load_scene(scene),
            objects,
            settings,
            backend,
            tests_a_goal=has_goals,
        )
        tried[name] = list(one.findings())
        if all(finding.good for finding in tried[name]):
            if not has_goals:
                tried[name].append(Finding("tests", True, "not tried: no goals ship for the scene"))
            return name, tried[name]
    best = max(tried, key=lambda name: len(tried[name]))
    return best, tried[best]


def _show(
    found: Mapping[str, Sequence[Finding]], hidden_names: Sequence[str], commands: Sequence[str]
) -> None:
    for name, findings in found.items():
        say(f"{name}:")
        for finding in findings:
            say(f"  {'ok' if finding.good else 'NO':3} {finding.what:8} {finding.detail}")
    if hidden_names:
        say(f"hidden from an isolated controller: {', '.join(hidden_names)}")
    if commands:
        say("play and test it with:")
        for command in commands:
            say(f"  {command}")


def _commands(subject: list[str], identity: Identity, told: OfficialOptions) -> list[list[str]]:
    """The command lines that play and test a controller, each as its words."""
    commands = []
    goals: list[str] = []
    if told.goals:
        commands.append(["realbench", "goals", "import", told.goals, "--out", "goals.npy"])
        goals = ["--goals", "goals.npy"]
    objects = ["--objects", str(told.objects)] if told.objects not in (None, 1) else []
    steps = ["--steps", str(told.steps)] if told.steps else []
    trials = ["--trials", str(told.trials)] if told.trials not in (None, 50) else []
    subject = [*subject, *objects]
    if identity.hands_over_state or identity.learns_from_experience:
        commands.append(["realbench", "intrinsic", *subject, *steps])
        commands.append(["realbench", "extrinsic", *goals, *trials])
    else:
        commands.append(["realbench", "evaluate", *subject, *steps, *goals, *trials])
    return commands
