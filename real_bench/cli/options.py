"""Options that several commands share."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from real_bench.phases.guest import Host
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

ISOLATION_OPTIONS: tuple[Decorator, ...] = (
    click.option(
        "--isolate/--no-isolate",
        default=False,
        help="Run the controller in a process of its own, where it reaches nothing else.",
    ),
    click.option("--memory-limit", type=float, metavar="GIB", help="Its memory. [default: 8]"),
    click.option("--call-limit", type=float, metavar="S", help="Time for a call. [default: 3600]"),
    click.option(
        "--total-limit", type=float, metavar="S", help="Time for all calls. [default: 86400]"
    ),
)

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


def recorded_settings(header: Header | None, controller: str | None, host: Host) -> dict[str, Any]:
    """The settings that a run was played with, if its controller is the one that is asked for."""
    from real_bench.finding import resolved

    if header is None or controller is None:
        return header.settings if header else {}
    one = host.identity(controller, None)
    same = header.is_of(resolved(controller), one.source_sha256, one.class_name)
    return header.settings if same else {}


@dataclass(frozen=True)
class Isolation:
    """What the isolation options say: whether, and what an isolated controller may use up."""

    isolate: bool = False
    memory_limit: float | None = None
    call_limit: float | None = None
    total_limit: float | None = None

    def host(self, secrets: Iterable[Path | None]) -> Host:
        """Where the controller is to run; says on standard error what isolates it there.

        Args:
            secrets: files and folders that an isolated controller must not be able to read.
        """
        given = {
            "memory_gib": self.memory_limit,
            "call_s": self.call_limit,
            "total_s": self.total_limit,
        }
        asked = {name: value for name, value in given.items() if value is not None}
        if not self.isolate:
            if asked:
                raise click.UsageError("limits are for isolated controllers: use --isolate, too")
            from real_bench.phases.local import LocalHost

            return LocalHost()
        from real_bench.isolation import IsolatedHost, Limits

        host = IsolatedHost(tuple(path for path in secrets if path is not None), Limits(**asked))
        click.echo(f"the controller is {host.walls.describe()}", err=True)
        return host


NOT_ISOLATED = Isolation()


def isolation_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Whether the controller runs in a process of its own; the command is given ``isolation``."""

    @wraps(command)
    def with_isolation(
        isolate: bool,
        memory_limit: float | None,
        call_limit: float | None,
        total_limit: float | None,
        **given: Any,
    ) -> Any:
        chosen = Isolation(isolate, memory_limit, call_limit, total_limit)
        return command(isolation=chosen, **given)

    wrapped: Callable[..., Any] = with_isolation
    for option in reversed(ISOLATION_OPTIONS):
        wrapped = option(wrapped)
    return wrapped
