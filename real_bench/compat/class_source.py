"""The source of a class that was passed as an object, from a script or a notebook."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import Any

from real_bench.controller_code.finding import source_file
from real_bench.controller_code.source import ControllerSource

NOWHERE = Path("(no file)")


class ClassSource(ControllerSource):
    """The file of a class, if it has one; the hash is of that file alone."""

    @classmethod
    def of_class(cls, kind: type[Any]) -> ClassSource:
        """The source of a class."""
        return cls(kind.__qualname__, source_file(kind), kind.__module__, kind.__qualname__)

    @cached_property
    def place(self) -> Path:
        """Its file."""
        return self.file or NOWHERE

    def code_files(self) -> list[Path]:
        """Its file, if there is one."""
        return [self.file] if self.file else []
