"""The command ``realbench``: one module a command, imported only when it is called."""

from __future__ import annotations

import importlib
from typing import Any, cast

import click

from real_bench.cli.common import Common, HelpfulGroup, traceback_of, with_common_options
from real_bench.version import __version__

COMMANDS = {
    "intrinsic": "play freely and record it",
    "extrinsic": "test a controller on goals and print the score table",
    "evaluate": "both phases in one process, as the official evaluation did",
    "check": "find out in a moment whether a controller will do",
    "submission": "begin, check and pack a submission to a competition",
    "round": "play and test all submissions of a competition",
    "leaderboard": "rank what came of a round, in a terminal, Markdown, JSON or as a site",
    "table": "make the table of an experiment: many plays and tests, published scores beside",
    "compare": "compare two sets of scores, goal by goal",
    "score": "judge results, for CI: exit code, Markdown, JUnit XML",
    "watch": "follow a play from another terminal, or for TensorBoard",
    "film": "make a film of any part of a recording",
    "export": "give a recording to others: CSV, Parquet, Minari",
    "verify": "prove a result or a recording by replaying it",
    "goals": "make, look at and import goal sets",
    "figures": "draw the paper's figures from recordings and results",
    "report": "one HTML file with tables, figures and every goal in pictures",
    "inspect": "say what is in a recording, goal set, result or experiment",
    "scene": "install and list scenes",
    "doctor": "check that this machine can run the benchmark",
}

EPILOG = """\b
Example:
  realbench scene install
  realbench intrinsic --controller real_r --steps 20000
  realbench extrinsic --trials 5
"""


class LazyGroup(HelpfulGroup):
    """A group that knows its commands' names and imports a command when it is called."""

    def list_commands(self, context: click.Context) -> list[str]:
        """Every command, in the order in which one meets them."""
        return list(COMMANDS)

    def get_command(self, context: click.Context, name: str) -> click.Command | None:
        """The command itself."""
        if name not in COMMANDS:
            return None
        module = importlib.import_module(f"real_bench.cli.{name}")
        return with_common_options(cast(click.Command, getattr(module, name)))

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
    """Run the command line; every foreseen error is one line and a non-zero exit code."""
    from real_bench.cli import streams
    from real_bench.cli.printing import log_on_stderr
    from real_bench.errors import Interrupted, RealBenchError

    streams.make_usable()
    log_on_stderr()
    common = Common()
    try:
        done = _called(arguments, common)
        streams.flush()
        return done
    except click.ClickException as error:
        command = (
            error.ctx.command_path if isinstance(error, click.UsageError) and error.ctx else ""
        )
        hint = f" (see `{command} --help`)" if command else ""
        streams.end(f"error: {error.format_message()}{hint}", error.exit_code)
    except Interrupted as error:
        streams.end(str(error), 130)
    except RealBenchError as error:
        streams.end(f"error: {error}", error.exit_code)
    except OSError as error:
        place = "" if error.filename is None else f"{error.filename}: "
        streams.end(f"error: {place}{error.strerror or error}", 1)
    except UnicodeError as error:
        streams.end(f"error: a name or text that is not UTF-8 ({error})", 1)
    except (click.Abort, KeyboardInterrupt):
        streams.end("interrupted", 130)


def _called(arguments: list[str] | None, common: Common) -> Any:
    """What the command gives; the traceback of a foreseen error is printed where it is wanted."""
    from real_bench.cli.printing import say
    from real_bench.errors import Interrupted, RealBenchError

    try:
        return cli.main(args=arguments, prog_name="realbench", standalone_mode=False, obj=common)
    except Interrupted:
        raise
    except (RealBenchError, OSError, UnicodeError) as error:
        if common.traceback:
            say(traceback_of(error), err=True)
        raise
