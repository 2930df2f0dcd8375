"""Options that several commands share."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from real_bench import lengths
from real_bench.cli.printing import say
from real_bench.files import defaults

if TYPE_CHECKING:
    from real_bench.phases.proxy import ControllerBackend

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
    help="One of the controller's settings, e.g. planner.depth=8; may be repeated.",
)
condition_option: Decorator = click.option(
    "--condition", metavar="XY", help="OM, IM, IJ, OJ, OC or IC, as in the paper."
)
objects_option: Decorator = click.option(
    "--objects", type=int, help="Number of objects, 1 to 3 in the scenes that ship."
)
scene_option: Decorator = click.option(
    "--scene", metavar="S", help="official, builtin, or the path to a manifest."
)
seed_option: Decorator = click.option("--seed", type=int, help="Seed of all randomness.")

LIMIT_OPTIONS: tuple[Decorator, ...] = (
    click.option(
        "--memory-limit", type=float, metavar="GIB", help="Memory it may use. [default: 8]"
    ),
    click.option(
        "--call-limit", type=float, metavar="S", help="Time limit per call. [default: 3600]"
    ),
    click.option(
        "--total-limit", type=float, metavar="S", help="Time limit for all calls. [default: 86400]"
    ),
)

trial_steps_option: Decorator = click.option(
    "--trial-steps",
    type=int,
    metavar="N",
    default=lambda: lengths.TRIAL_STEPS,
    show_default="10,000",
    help="Length of a trial; with another one, scores do not compare with published ones.",
)

goals_option: Decorator = click.option(
    "--goals", type=FILE, help="Goal set. [default: the shipped one]"
)
trials_option: Decorator = click.option(
    "--trials", type=int, help="Test only N goals, each class in proportion. [default: all]"
)
result_option: Decorator = click.option(
    "--out", type=FILE, default=defaults.RESULT, show_default=True
)
jobs_at_once_option: Decorator = click.option(
    "--jobs", type=click.IntRange(min=1), help="Jobs at once. [default: one per core]"
)
scheduler_option: Decorator = click.option(
    "--scheduler", metavar="ADDRESS", help="Run the jobs on this Dask cluster."
)
round_option: Decorator = click.option(
    "--round", "name", metavar="NAME", help="Only this round. [default: all]"
)

TESTING_OPTIONS: tuple[Decorator, ...] = (
    click.option(
        "--run",
        type=FILE,
        help=f"Recording to learn from. [default: {defaults.RUN}, if it fits]",
    ),
    click.option(
        "--run-steps",
        type=int,
        metavar="N",
        help="Learn only from its first N steps. [default: all]",
    ),
    click.option(
        "--keep-learned",
        "learned",
        flag_value="keep",
        help="Use what it learned with other code or settings.",
    ),
    click.option(
        "--relearn",
        "learned",
        flag_value="again",
        help="Let it learn again from the recording instead of using what it learned then.",
    ),
    click.option(
        "--as-made",
        "learned",
        flag_value="nothing",
        help="Test it even if the recording does not hold what it learned.",
    ),
    goals_option,
    trials_option,
    trial_steps_option,
    click.option("--jobs", type=int, default=1, show_default=True, help="Number of processes."),
    result_option,
)

SETTING_OPTIONS: tuple[Decorator, ...] = (
    controller_option,
    settings_option,
    set_option,
    condition_option,
    objects_option,
    scene_option,
    seed_option,
)
allow_part_option: Decorator = click.option(
    "--allow-part", is_flag=True, help="Also judge a test of only part of the goals."
)
junit_option: Decorator = click.option("--junit", type=FILE, help="Write the checks as JUnit XML.")
resume_option: Decorator = click.option(
    "--resume", is_flag=True, help="Continue where the output file ends, if it exists."
)
overwrite_option: Decorator = click.option(
    "--overwrite", is_flag=True, help="Replace the output file if it exists."
)
json_option: Decorator = click.option(
    "--json", "as_json", is_flag=True, help="Print JSON on standard output."
)


def setting_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Options of both phases: who plays, with what settings, under which condition, where."""
    return _add_options(SETTING_OPTIONS, command)


def testing_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Further options of a test: what to learn from, the goals, where the result goes."""
    return _add_options(TESTING_OPTIONS, command)


@dataclass(frozen=True)
class Isolation:
    """The values of the isolation options: whether to isolate, and within which limits."""

    isolate: bool = False
    limits: Mapping[str, float] = field(default_factory=dict)

    def backend(self, secrets: Iterable[Path | None]) -> ControllerBackend:
        """Where the controller will run; prints on standard error what isolates it.

        Args:
            secrets: files and folders that an isolated controller must not be able to read.
        """
        if not self.isolate:
            self.check()
            from real_bench.phases.local import LocalBackend

            return LocalBackend()
        from real_bench.sandbox import Limits, SandboxBackend

        backend = SandboxBackend(
            tuple(path for path in secrets if path is not None), Limits(**self.limits)
        )
        print_isolation()
        return backend

    def check(self) -> None:
        """Raise UsageError for limits of what is not isolated."""
        if self.limits and not self.isolate:
            raise click.UsageError("limits are for isolated controllers: add --isolate")


def limit_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Options for limits of an isolated controller; the command gets those given as ``limits``."""

    @wraps(command)
    def with_limits(
        memory_limit: float | None,
        call_limit: float | None,
        total_limit: float | None,
        **given: Any,
    ) -> Any:
        limits = {"memory_gib": memory_limit, "call_s": call_limit, "total_s": total_limit}
        given_limits = {name: value for name, value in limits.items() if value is not None}
        return command(limits=given_limits, **given)

    return _add_options(LIMIT_OPTIONS, with_limits)


def print_isolation() -> None:
    """Print on standard error what isolates controllers here, and what is not enforced."""
    from real_bench.sandbox import sandbox_support

    say(f"the controller is {sandbox_support().describe()}", err=True)


def isolate_option(*, by_default: bool = False) -> Decorator:
    """Whether controllers run in a process of their own."""
    return click.option(
        "--isolate/--no-isolate",
        default=by_default,
        show_default=True,
        help="Run the controller in a process of its own that cannot reach anything else.",
    )


def isolation_options(*, by_default: bool = False) -> Decorator:
    """Options for whether to isolate, and the limits; the command gets ``isolation``."""

    def decorator(command: Callable[..., Any]) -> Callable[..., Any]:
        @wraps(command)
        def with_isolation(isolate: bool, limits: Mapping[str, float], **given: Any) -> Any:
            return command(isolation=Isolation(isolate, limits), **given)

        limited = limit_options(with_isolation)
        return _add_options((isolate_option(by_default=by_default),), limited)

    return decorator


def _add_options(chosen: Iterable[Decorator], command: Callable[..., Any]) -> Callable[..., Any]:
    """The command with options, in the order in which its help shows them."""
    for option in reversed(tuple(chosen)):
        command = option(command)
    return command
