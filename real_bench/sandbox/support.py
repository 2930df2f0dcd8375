"""The isolation that a system supports, and how it is set up."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from real_bench.sandbox import landlock, seccomp
from real_bench.sandbox.limits import TEMPORARY_BYTES, Limits
from real_bench.sandbox.visible_files import SYSTEM, VisibleFiles

START = Path(__file__).with_name("start.py")
DEVICES = ("/dev/null", "/dev/zero", "/dev/random", "/dev/urandom")
TIMEOUT_S = 20.0


@dataclass(frozen=True)
class SandboxSupport:
    """What this system can enforce.

    Attributes:
        bubblewrap: the program, if it is there and works: own file system, processes, network.
        landlock: whether the kernel restricts a process to some files; used without bubblewrap.
        seccomp: whether the kernel filters system calls: no new processes, no network.
    """

    bubblewrap: str | None
    landlock: bool
    seccomp: bool

    @property
    def keep_files(self) -> bool:
        """Whether files are out of the controller's reach."""
        return bool(self.bubblewrap) or self.landlock

    def missing(self) -> list[str]:
        """What is not enforced, in words."""
        faults = []
        if not self.keep_files:
            faults.append("files: it can read goals and write results as you can")
        if not self.bubblewrap and not self.seccomp:
            faults.append("network, and signals to other processes")
        if not self.seccomp:
            faults.append("the number of processes")
        if not self.bubblewrap:
            faults.append("disk space in its temporary folder")
            faults.append("modes, times and sizes of files: it can see all, and change yours")
        if sys.platform != "linux":
            faults.append("memory, on some systems")
        return faults

    def describe(self) -> str:
        """One line: what isolates, and what is not enforced."""
        means = {
            "bubblewrap": self.bubblewrap,
            "landlock": self.landlock and not self.bubblewrap,
            "seccomp": self.seccomp,
        }
        by = " and ".join(name for name, there in means.items() if there) or "its own process"
        missing = self.missing()
        return f"isolated by {by}" + (f"; NOT enforced: {'; '.join(missing)}" if missing else "")


def kernel_support() -> SandboxSupport:
    """What the kernel alone enforces."""
    return SandboxSupport(None, landlock.version() > 0, seccomp.available())


@cache
def sandbox_support() -> SandboxSupport:
    """The best that this system offers; tries whether bubblewrap works."""
    bare = kernel_support()
    program = shutil.which("bwrap")
    return SandboxSupport(
        program if program and _works(program) else None, bare.landlock, bare.seccomp
    )


def _works(program: str) -> bool:
    there = (path for path in SYSTEM if Path(path).exists())
    command = [program, *_NAMESPACES, *_flat(("--ro-bind", path, path) for path in there)]
    try:
        done = subprocess.run(
            [*command, "--proc", "/proc", "--dev", "/dev", "--", "/usr/bin/env", "true"],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=TIMEOUT_S,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return False
    return done.returncode == 0


_NAMESPACES = (
    "--unshare-all",
    "--unshare-user",
    "--uid",
    "65534",
    "--gid",
    "65534",
    "--hostname",
    "isolated",
    "--cap-drop",
    "ALL",
    "--die-with-parent",
)


@dataclass(frozen=True)
class Site:
    """Where one controller runs.

    Attributes:
        folder: a folder of its own; it can read ``inbox``, and write into ``tmp``.
        channel: the descriptor of its end of the channel.
    """

    folder: Path
    channel: int

    @property
    def inbox(self) -> Path:
        """What the benchmark gives it to read."""
        return self.folder / "inbox"

    @property
    def tmp(self) -> Path:
        """What it may write."""
        return self.folder / "tmp"


def python_command(
    support: SandboxSupport, visible: VisibleFiles, limits: Limits, site: Site
) -> list[str]:
    """The command of the child itself."""
    bare_reach = None
    if support.landlock and not support.bubblewrap:
        bare_reach = {
            "read": [str(path) for path in (*_visible_paths(visible), site.inbox)],
            "write": [*(path for path in DEVICES if Path(path).exists()), str(site.tmp)],
            "names": [str(path.parent) for path in visible.own],  # Python lists them to import
        }
    orders = {
        "channel": site.channel,
        "parent": None if support.bubblewrap else os.getpid(),
        "memory_bytes": limits.memory_bytes,
        "file_bytes": TEMPORARY_BYTES,
        "seccomp": support.seccomp,
        "reach": bare_reach,
        "import_from": [str(path) for path in visible.import_from],
        "workplace": {
            "place": "/tmp/work" if support.bubblewrap else str(site.tmp / "work"),
            "folder": str(visible.folder) if visible.folder else None,
            "own": [str(path) for path in visible.own if visible.folder],
            "hidden": [str(path) for path in visible.hidden if visible.folder],
        },
    }
    return [sys.executable, "-I", "-X", "faulthandler", str(START), json.dumps(orders)]


def bubblewrap_options(visible: VisibleFiles, site: Site) -> list[str]:
    """The options of bubblewrap; later ones lie over earlier ones."""
    links = [path for path in SYSTEM if Path(path).is_symlink()]
    folders = [path for path in (*visible.shared, *visible.own) if str(path) not in links]
    return [
        *_NAMESPACES,
        *("--proc", "/proc", "--dev", "/dev"),
        # Root outside could write the system's settings, whoever it appears to be inside.
        *("--remount-ro", "/dev", "--remount-ro", "/proc"),
        *("--size", str(TEMPORARY_BYTES), "--tmpfs", "/tmp"),
        *_flat(("--symlink", str(Path(path).readlink()), path) for path in links),
        *_flat(("--ro-bind", str(path), str(path)) for path in folders),
        *_flat(_mask(path) for path in _masked_paths(visible)),
        *("--ro-bind", str(site.inbox), str(site.inbox)),
        *("--remount-ro", "/", "--chdir", "/tmp"),
    ]


def _visible_paths(visible: VisibleFiles) -> Iterator[Path]:
    """What is visible, without the folders hidden in it, where it really is."""
    for path in {path.resolve(): None for path in (*visible.shared, *visible.own)}:
        yield from _excluding(path, [hidden.resolve() for hidden in visible.hidden])


def _excluding(path: Path, hidden: list[Path]) -> Iterator[Path]:
    """Leave out links: a rule would hold for what they lead to."""
    if path in hidden:
        return
    if any(one.is_relative_to(path) for one in hidden):
        for part in path.iterdir():
            if not part.is_symlink():
                yield from _excluding(part, hidden)
    else:
        yield path


def _masked_paths(visible: VisibleFiles) -> list[Path]:
    roots = (*visible.shared, *visible.own)
    return [path for path in visible.hidden if any(path.is_relative_to(root) for root in roots)]


def _mask(path: Path) -> tuple[str, ...]:
    """What covers something hidden: an empty folder, or an empty file."""
    if path.is_dir():
        return ("--size", "65536", "--tmpfs", str(path))
    return ("--ro-bind", "/dev/null", str(path))


def _flat(groups: Iterable[Iterable[str]]) -> Iterator[str]:
    for group in groups:
        yield from group
