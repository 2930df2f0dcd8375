"""Commands in this process, and strange files."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import pytest

from real_bench.cli import main

NOBODY = 65534
ROOT = os.geteuid() == 0
needs_root = pytest.mark.skipif(not ROOT, reason="only root makes devices and mounts")


class Done(NamedTuple):
    """How a command ended."""

    code: int
    out: str
    err: str

    @property
    def last(self) -> str:
        """The last line on standard error."""
        return self.err.splitlines()[-1] if self.err else ""


def command(capfd: pytest.CaptureFixture[str], *arguments: object) -> Done:
    """Run a command in this process, its outermost guard included."""
    capfd.readouterr()
    code = 0
    try:
        main([str(argument) for argument in arguments])
    except SystemExit as error:
        code = int(error.code or 0)
    out, err = capfd.readouterr()
    return Done(code, out, after_first_line(err))


def after_first_line(err: str) -> str:
    """What is said after the line that every run begins with: which class of which file it runs."""
    first, _, rest = err.partition("\n")
    return rest if first.startswith("controller: class ") else err


def check_readable_to_all() -> None:
    """Skip a test as another user where that one may not read this code."""
    for folder in Path(__file__).resolve().parents:
        if folder.stat().st_mode & 0o005 != 0o005:
            pytest.skip(f"another user may not read {folder}")


@contextmanager
def as_nobody() -> Iterator[None]:
    """Without root's rights, which know no read-only file."""
    if not ROOT:
        yield
        return
    check_readable_to_all()
    os.setegid(NOBODY)
    os.seteuid(NOBODY)
    try:
        yield
    finally:
        os.seteuid(0)
        os.setegid(0)


def state_of(folder: Path) -> dict[str, tuple[int, int, bytes]]:
    """Kind, mode and content of everything in a folder, links not followed."""
    found = {}
    for path in sorted(folder.rglob("*")):
        facts = path.lstat()
        content = path.read_bytes() if stat.S_ISREG(facts.st_mode) else b""
        if path.is_symlink():
            content = os.fsencode(path.readlink())
        name = str(path.relative_to(folder))
        found[name] = (stat.S_IFMT(facts.st_mode), stat.S_IMODE(facts.st_mode), content)
    return found
