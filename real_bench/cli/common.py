"""What every command has: ``--traceback`` and ``--no-progress``, and help where it stands alone."""

from __future__ import annotations

import copy
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import click


@dataclass
class Common:
    """What the common options say.

    Attributes:
        traceback: print the whole traceback of an error, too.
        progress: show how far long work has come.
    """

    traceback: bool = False
    progress: bool = True


class HelpfulGroup(click.Group):
    """Commands under one name, which alone prints their help."""

    def parse_args(self, context: click.Context, arguments: list[str]) -> list[str]:
        """Take the arguments apart, where there are any."""
        if not arguments:
            click.echo(context.get_help())
            context.exit()
        return super().parse_args(context, arguments)


def with_common_options(command: click.Command) -> click.Command:
    """The command, and those below it, with the common options as well."""
    more = copy.copy(command)
    if isinstance(more, click.Group):
        more.commands = {name: with_common_options(each) for name, each in more.commands.items()}
    else:
        more.params = [*more.params, *_OPTIONS]
    return more


def progress_wanted() -> bool:
    """Whether the command that is running is to show how far it has come."""
    context = click.get_current_context(silent=True)
    common = None if context is None else context.find_object(Common)
    return common is None or common.progress


def traceback_of(error: BaseException) -> str:
    """Where an error came from, with all that led to it, in whatever process."""
    return "".join(traceback.format_exception(error)).rstrip()


def _flag(*names: str, set_to: bool, **described: Any) -> click.Option:
    return click.Option(
        names, is_flag=True, expose_value=False, callback=_noted(set_to), **described
    )


def _noted(value: bool) -> Callable[[click.Context, click.Parameter, bool], None]:
    def note(context: click.Context, parameter: click.Parameter, given: bool) -> None:
        if given:
            setattr(context.ensure_object(Common), str(parameter.name), value)

    return note


_OPTIONS = (
    _flag(
        "--traceback",
        set_to=True,
        help="Where something fails, print the traceback as well: file and line of every call.",
    ),
    _flag("progress", "--no-progress", set_to=False, help="Do not show how far it has come."),
)
