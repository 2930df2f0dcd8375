"""The command ``realbench``: one module per command, imported only when called."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any, cast

import click

from real_bench.cli.common import (
    Common,
    HelpfulGroup,
    meant_option,
    traceback_of,
    with_common_options,
)
from real_bench.version import __version__

if TYPE_CHECKING:
    from real_bench.errors import Interrupted

COMMANDS = {
    "intrinsic": "play freely and record it",
    "extrinsic": "test a controller on goals and print the score table",
    "evaluate": "both phases in one process, as the official evaluation did",
    "check": "check quickly whether a controller works",
    "submission": "create, check and pack a submission to a competition",
    "round": "play and test all submissions of a competition",
    "leaderboard": "rank a round's results: in the terminal, as Markdown, JSON or a site",
    "table": "run an experiment's plays and tests, and print its table beside published scores",
    "compare": "compare two sets of scores, goal by goal",
    "score": "judge results, for CI: exit code, Markdown, JUnit XML",
    "watch": "follow a play from another terminal or in TensorBoard",
    "film": "make a film of any part of a recording",
    "export": "convert a recording to CSV, Parquet or Minari",
    "verify": "prove a result or a recording by replaying it",
    "goals": "make, look at and import goal sets",
    "figures": "draw the paper's figures from recordings and results",
    "report": "write one HTML file with tables, figures and pictures of every goal",
    "inspect": "show what is in a recording, goal set, result or experiment",
    "scene": "install and list scenes",
    "doctor": "check that this machine can run the benchmark",
}

EPILOG = """\b
Example:
  realbench scene install
  realbench intrinsic --controller real_r --steps 20000
  realbench extrinsic --trials 5
"""


class Stopped(Exception):  # noqa: N818  a wish, not a fault
    """A command that the user stopped."""

    def __init__(self, stop: Interrupted) -> None:
        super().__init__(f"{stop}{': repeat the command with --resume' if stop.can_resume else ''}")


class LazyGroup(HelpfulGroup):
    """A group that knows its commands' names and imports a command when it is called."""

    def list_commands(self, context: click.Context) -> list[str]:
        """The names of all commands, in the order in which users need them."""
        return list(COMMANDS)

    def get_command(self, context: click.Context, name: str) -> click.Command | None:
        """Import a command; None if there is none of that name."""
        if name not in COMMANDS:
            return None
        module = importlib.import_module(f"real_bench.cli.{name}")
        return with_common_options(cast(click.Command, getattr(module, name)))

    def invoke(self, context: click.Context) -> Any:
        """Run a command; click would take the wish to stop for one to abort."""
        from real_bench.errors import Interrupted

        try:
            return super().invoke(context)
        except Interrupted as stop:
            raise Stopped(stop) from stop

    def format_commands(self, context: click.Context, formatter: click.HelpFormatter) -> None:
        """List the commands without importing them."""
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


@click.group(
    cls=LazyGroup,
    epilog=EPILOG,
    context_settings={"help_option_names": ["-h", "--help"]},
)
@click.version_option(__version__, prog_name="realbench")
def cli() -> None:
    """The REAL benchmark: a robot plays for 15 million steps, without goal or reward, and is then
    tested on 50 goals that it has never seen."""  # noqa: D205, D209


def main(arguments: list[str] | None = None) -> Any:
    """Run the command line; an expected error ends it with one line and a non-zero exit code."""
    from real_bench.cli import streams
    from real_bench.cli.printing import log_on_stderr
    from real_bench.errors import RealBenchError

    streams.make_usable()
    log_on_stderr()
    common = Common()
    try:
        done = _invoke(arguments, common)
        streams.flush()
        return done
    except click.ClickException as error:
        command = (
            error.ctx.command_path if isinstance(error, click.UsageError) and error.ctx else ""
        )
        hint = f"{meant_option(error)} (see `{command} --help`)" if command else ""
        streams.end(f"error: {error.format_message()}{hint}", error.exit_code)
    except Stopped as stopped:
        streams.end(str(stopped), 130)
    except RealBenchError as error:
        streams.end(f"error: {error}", error.exit_code)
    except OSError as error:
        place = "" if error.filename is None else f"{error.filename}: "
        streams.end(f"error: {place}{error.strerror or error}", 1)
    except UnicodeError as error:
        streams.end(f"error: a name or text is not UTF-8 ({error})", 1)
    except (click.Abort, KeyboardInterrupt):
        streams.end("interrupted", 130)


def _invoke(arguments: list[str] | None, common: Common) -> Any:
    """Run the command; with --traceback, print the traceback of an expected error."""
    from real_bench.cli.printing import say
    from real_bench.errors import RealBenchError

    try:
        return cli.main(args=arguments, prog_name="realbench", standalone_mode=False, obj=common)
    except (RealBenchError, OSError, UnicodeError) as error:
        if common.traceback:
            say(traceback_of(error), err=True)
        raise
