"""Options that several commands share."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from real_bench.recording import Header

DEFAULT_RUN = Path("run.h5")
DEFAULT_RESULT = Path("score.json")

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]

FILE = click.Path(path_type=Path)

controller_option: Decorator = click.option(
    "--controller", metavar="C", help="Name, module:Class, or file.py[:Class]."
)
settings_option: Decorator = click.option(
    "--settings", "settings_file", type=FILE, help="YAML file of the controller's settings."
)
set_option: Decorator = click.option(
    "--set",
    "assignments",
    multiple=True,
    metavar="NAME=VALUE",
    help="One of the controller's settings, as in planner.depth=8; may be repeated.",
)
condition_option: Decorator = click.option(
    "--condition", metavar="XY", help="OM, IM, IJ, OJ, OC or IC, by the paper's names."
)
objects_option: Decorator = click.option("--objects", type=int, help="Number of objects, 1 to 3.")
scene_option: Decorator = click.option(
    "--scene", metavar="S", help="official, builtin, or the path of a manifest."
)
seed_option: Decorator = click.option("--seed", type=int, help="Seed of all randomness.")

SETTING_OPTIONS = (
    controller_option,
    settings_option,
    set_option,
    condition_option,
    objects_option,
    scene_option,
    seed_option,
)
resume_option: Decorator = click.option(
    "--resume", is_flag=True, help="Go on where the output file ends, if it exists."
)
overwrite_option: Decorator = click.option(
    "--overwrite", is_flag=True, help="Replace the output file if it exists."
)
json_option: Decorator = click.option(
    "--json", "as_json", is_flag=True, help="Print JSON on standard output."
)


def setting_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """What every phase is told: who plays, with what settings, under which condition, where."""
    for option in reversed(SETTING_OPTIONS):
        command = option(command)
    return command


def recorded_settings(header: Header | None, controller: str | None) -> dict[str, Any]:
    """The settings that a run was played with, if its controller is the one that is asked for."""
    from real_bench.finding import find_controller, resolved, source_sha256

    if header is None or controller is None:
        return header.settings if header else {}
    kind = find_controller(controller)
    same = header.is_of(resolved(controller), source_sha256(kind), kind.__qualname__)
    return header.settings if same else {}
