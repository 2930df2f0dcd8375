"""Optional libraries, each loaded where it is used."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from real_bench.errors import RealBenchError


class MissingExtraError(RealBenchError):
    """An optional library that is not installed, with the command to install it."""


def extra(module: str, name: str) -> Any:
    """A module of an optional library.

    Args:
        module: to import.
        name: of our extra that installs it.

    Raises:
        MissingExtraError: it is not installed.
    """
    try:
        return import_module(module)
    except ImportError as error:
        package = module.partition(".")[0]
        raise MissingExtraError(
            f"this needs {package}, which cannot be loaded ({error}): "
            f"pip install 'real-bench[{name}]'"
        ) from error
