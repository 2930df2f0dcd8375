"""Messages for Python: remedies that name a command's option name the argument instead."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

from real_bench.errors import RealBenchError

P = ParamSpec("P")
T = TypeVar("T")

_OPTION = re.compile(
    r"(?<=[`(])realbench [^`)]*"  # a whole command stays one
    r"|(?<![\w/.-])--([a-z][a-z-]*)(?: (\d[\d,]*|official|builtin|real_[a-z]+)\b)?"
)
_ARGUMENTS = {
    "--keep-learned": 'learned="keep"',
    "--relearn": 'learned="again"',
    "--as-made": 'learned="nothing"',
    "--no-images": "images=False",
    "--set": "settings",
}
_FLAGS = {"resume", "overwrite", "isolate", "images", "allow_part"}


def in_python(message: str) -> str:
    """A message with arguments of functions for options of commands.

    >>> in_python("run.h5 exists: use --resume or --overwrite, or another --out")
    'run.h5 exists: use resume=True or overwrite=True, or another out'
    """
    return _OPTION.sub(_argument, message)


def speaks_python(function: Callable[P, T]) -> Callable[P, T]:
    """Let the errors of a function say its arguments, not a command's options."""

    @wraps(function)
    def speaking(*arguments: P.args, **given: P.kwargs) -> T:
        try:
            return function(*arguments, **given)
        except RealBenchError as error:
            error.args = tuple(
                in_python(each) if isinstance(each, str) else each for each in error.args
            )
            raise

    return speaking


def _argument(found: re.Match[str]) -> str:
    if found[1] is None:
        return found[0]
    option, value = f"--{found[1]}", found[2]
    name = found[1].replace("-", "_")
    if option in _ARGUMENTS:
        return _ARGUMENTS[option]
    if value is not None:
        return f"{name}={value}" if value[0].isdigit() else f'{name}="{value}"'
    return f"{name}=True" if name in _FLAGS else name
