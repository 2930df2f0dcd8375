"""What all commands share: ``--traceback``, ``--no-progress``, and groups that print their help."""

from __future__ import annotations

import copy
import re
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from real_bench.cli.outputs import with_inputs_kept

if TYPE_CHECKING:
    from real_bench.progress.display import ProgressDisplay


@dataclass
class Common:
    """The values of the common options.

    Attributes:
        traceback: also print the traceback of an error.
        progress: show the progress of long work.
    """

    traceback: bool = False
    progress: bool = True


class HelpfulGroup(click.Group):
    """A group of commands that prints its help when called alone."""

    def parse_args(self, context: click.Context, arguments: list[str]) -> list[str]:
        """Parse the arguments; without any, print the help."""
        if not arguments:
            click.echo(context.get_help())
            context.exit()
        return super().parse_args(context, arguments)


def with_common_options(command: click.Command) -> click.Command:
    """A copy of the command, and of those below it, with the common options added."""
    more = copy.copy(command)
    if isinstance(more, click.Group):
        more.commands = {name: with_common_options(each) for name, each in more.commands.items()}
    else:
        more = with_inputs_kept(more)
        more.params = [*more.params, *_OPTIONS]
    return more


def progress_wanted() -> bool:
    """Whether the running command should show progress."""
    context = click.get_current_context(silent=True)
    common = None if context is None else context.find_object(Common)
    return common is None or common.progress


def progress_display(title: str, unit: str, total: int) -> ProgressDisplay:
    """The progress of a command's work; ``--no-progress`` hides it."""
    from real_bench.progress.display import ProgressDisplay

    return ProgressDisplay(title, unit, total, shown=progress_wanted())


def meant_option(error: click.ClickException) -> str:
    """What to write instead of a file that a command takes by an option alone; empty otherwise."""
    extra = re.search(r"unexpected extra arguments? \((\S+?)\)?(?: |$)", error.format_message())
    if extra is None or not isinstance(error, click.UsageError) or error.ctx is None:
        return ""
    option = _OPTION_FOR.get(Path(extra[1]).suffix, "")
    known = {name for each in error.ctx.command.params for name in each.opts}
    return f", did you mean {option} {extra[1]}?" if option in known else ""


def traceback_of(error: BaseException) -> str:
    """The traceback of an error, with its causes, from whatever process."""
    return "".join(traceback.format_exception(error)).rstrip()


def _flag(*names: str, set_to: bool, **described: Any) -> click.Option:
    return click.Option(
        names, is_flag=True, expose_value=False, callback=_store_flag(set_to), **described
    )


def _store_flag(value: bool) -> Callable[[click.Context, click.Parameter, bool], None]:
    def store(context: click.Context, parameter: click.Parameter, given: bool) -> None:
        if given:
            setattr(context.ensure_object(Common), str(parameter.name), value)

    return store


_OPTION_FOR = {".py": "--controller", ".h5": "--run", ".npy": "--goals", ".yaml": "--settings"}

_OPTIONS = (
    _flag(
        "--traceback",
        set_to=True,
        help="On an error, also print the traceback: file and line of every call.",
    ),
    _flag("progress", "--no-progress", set_to=False, help="Do not show progress."),
)
