"""Optional libraries, each loaded where it is used."""

from __future__ import annotations

from importlib import import_module
from importlib.metadata import version
from typing import Any

from real_bench.errors import RealBenchError


class MissingExtraError(RealBenchError):
    """An optional library that is not installed, with the command to install it."""


def extra(module: str, name: str, at_least: str = "") -> Any:
    """A module of an optional library.

    Args:
        module: to import.
        name: of our extra that installs it.
        at_least: the oldest version that serves; any where empty.

    Raises:
        MissingExtraError: it is not installed, or too old.
    """
    package = module.partition(".")[0]
    try:
        found = import_module(module)
    except ImportError as error:
        raise MissingExtraError(
            f"this needs {package}, which cannot be loaded ({error}): "
            f"pip install 'real-bench[{name}]'"
        ) from error
    if at_least:
        from packaging.version import Version

        if Version(version(package)) < Version(at_least):
            raise MissingExtraError(
                f"this needs {package} {at_least}, and {version(package)} is installed: "
                f"pip install '{package}>={at_least}'"
            )
    return found
