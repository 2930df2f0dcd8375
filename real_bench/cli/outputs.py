"""No command writes over a file that it reads; outputs that several commands have."""

from __future__ import annotations

from collections.abc import Iterator
from functools import wraps
from pathlib import Path
from typing import Any

import click

from real_bench.files import defaults
from real_bench.files.atomic import real_path
from real_bench.files.kinds import JUNIT
from real_bench.files.output_streams import Output
from real_bench.text.naming import CONTROLLER_FILE

OUTPUTS = ("out", "junit", "markdown")
"""The options that name a file to be written."""

WRITTEN_TOO = {"evaluate": ("run",)}
"""Other options that do so in some commands."""

WITHOUT_OUT = {"score": "files"}
"""Commands that write no ``--out`` if they are given this."""

RESULTS = ("files", "baseline")
"""Arguments and options that name results: a file, a folder or a pattern."""


def junit_output(context: click.Context, path: Path | None, *, overwrite: bool) -> Output | None:
    """The JUnit XML that was asked for, checked now and closed with the command."""
    if path is None:
        return None
    output = Output(path, overwrite=overwrite, kind=JUNIT, option="--junit")
    return context.with_resource(output)


def with_inputs_kept(command: click.Command) -> click.Command:
    """Let a command refuse an output that is one of its inputs, whatever else it was told."""
    run = command.callback
    assert run is not None

    @wraps(run)
    def checked(*arguments: Any, **given: Any) -> Any:
        _check(click.get_current_context())
        return run(*arguments, **given)

    command.callback = checked
    return command


def _check(context: click.Context) -> None:
    """Raise UsageError if an output is another file that the command was told."""
    told = list(_files(context))
    outputs = (*OUTPUTS, *WRITTEN_TOO.get(context.info_name or "", ()))
    for output, out in told:
        if output.name not in outputs or output.metavar == "DIR":
            continue
        for other, path in told:
            if other.name != output.name and _is_same(out, path):
                raise click.UsageError(
                    f"{_named(output)} {out} is also {_named(other)}: give another file", context
                )


def _files(context: click.Context) -> Iterator[tuple[click.Parameter, Path]]:
    """All files that the command line names, or that are taken by default."""
    writes_out = not context.params.get(WITHOUT_OUT.get(context.info_name or "", ""))
    for parameter in context.command.params:
        value = context.params.get(parameter.name or "")
        if parameter.name == "out" and not writes_out:
            continue
        if parameter.name == "run" and value is None:
            value = defaults.RUN
        if parameter.name == "controller" and (file := CONTROLLER_FILE.fullmatch(value or "")):
            value = Path(file["file"])
        for each in value if isinstance(value, tuple) else (value,):
            if isinstance(each, Path):
                yield parameter, each
            elif parameter.name in RESULTS and each is not None:
                yield from ((parameter, file) for file in _results(each))


def _results(named: str) -> list[Path]:
    from real_bench.scoring.named import named_files

    return named_files(named)


def _is_same(one: Path, other: Path) -> bool:
    """Whether two paths are of one file, or will be; a name that is too long is of none."""
    try:
        if one.exists() or other.exists():
            return one.is_file() and one.samefile(other)
        return real_path(one) == real_path(other)
    except OSError:
        return False


def _named(parameter: click.Parameter) -> str:
    return parameter.opts[0] if isinstance(parameter, click.Option) else "an input"
