"""Whether what a controller defines can be called as it will be."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

from real_bench.controller import Controller


def accepts(function: Callable[..., Any], arguments: tuple[Any, ...]) -> bool:
    """Whether it takes these arguments; True if it is not written in Python, and nobody knows."""
    try:
        signature = inspect.signature(function)
    except (TypeError, ValueError):
        return True
    try:
        signature.bind(*arguments)
    except TypeError:
        return False
    return True


def misfit(function: Callable[..., Any], arguments: tuple[Any, ...]) -> str:
    """Where a hook is that does not take its arguments, and what it must take; empty if it does.

    Args:
        function: a controller's class, or a method of a controller.
        arguments: that it will be called with.
    """
    if accepts(function, arguments):
        return ""
    defined = function.__init__ if isinstance(function, type) else function  # type: ignore[misc]
    ours = getattr(Controller, defined.__name__, None)
    code = getattr(defined, "__code__", None)
    if code is None or ours is None:
        return ""
    takes = ", ".join([*inspect.signature(ours).parameters][: 1 + len(arguments)])
    return f"{code.co_filename}, line {code.co_firstlineno}: it must be {defined.__name__}({takes})"
