"""What of the file system an isolated controller sees: Python, its packages, its own files."""

from __future__ import annotations

import site
import sys
import sysconfig
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from real_bench.controller_code.benchmark_files import is_benchmark_file
from real_bench.controller_code.source import (
    OURS,
    ControllerSource,
    ignored_paths,
    is_ignored,
    module_location,
)
from real_bench.errors import ControllerError

SYSTEM = (
    "/usr",
    "/bin",
    "/lib",
    "/lib32",
    "/lib64",
    "/etc/alternatives",
    "/etc/ld.so.cache",
    "/etc/localtime",
    "/sys/devices/system/cpu",  # the number of cores decides how sums are split
)


@dataclass(frozen=True)
class VisibleFiles:
    """Paths that are visible, read-only, where they are.

    Attributes:
        own: the files and folders that the controller came with.
        shared: Python, its packages, and the system's libraries.
        hidden: folders and files among these that are invisible: goals, recordings and results.
        import_from: folders to import from besides Python's own.
        folder: the folder of a controller that is a file; a copy of its visible part is the
            working directory.
    """

    own: tuple[Path, ...]
    shared: tuple[Path, ...]
    hidden: tuple[Path, ...]
    import_from: tuple[Path, ...] = ()
    folder: Path | None = None

    def check_hides(self, secrets: Iterable[Path]) -> None:
        """Raise ControllerError if the controller could see one of these."""
        for secret in secrets:
            place = secret.resolve()
            if _within(place, self.hidden):
                continue
            if _within(place, self.own) or _within(place, self.shared):
                raise ControllerError(
                    f"{secret} lies where an isolated controller may read: keep it outside "
                    "the controller's package, Python and the system's folders"
                )

    def hidden_names(self) -> list[str]:
        """What is hidden in the controller's own folder, by name; caches and such aside."""
        if self.folder is None:
            return []
        return [
            path.relative_to(self.folder).as_posix()
            for path in self.hidden
            if path.is_relative_to(self.folder) and not is_ignored(path)
        ]


def visible_files(
    source: ControllerSource, secrets: Iterable[Path] = (), packages: Path | None = None
) -> VisibleFiles:
    """What a controller sees; found without importing any of it.

    In the folder of its file a controller sees everything that is there at the start except links,
    caches of tools, recordings, goals and results, and secrets. What is added later is invisible,
    unless in a folder of it.

    Args:
        source: the controller.
        secrets: files and folders that it must not see; those in its folder are hidden.
        packages: the folder of what a submission requires.

    Raises:
        ControllerError: there is no such module.
    """
    required = () if packages is None else (packages,)
    shared, hidden = (*_shared(), *required), tuple(_hidden())
    if source.file is None:
        other_roots = () if _within(source.place, shared) else (source.place.parent,)
        return VisibleFiles((source.place,), shared, hidden, (*_user_site(), *other_roots))
    secret = [path for path in source.files() if is_benchmark_file(path)]
    secret += ignored_paths(source.place)  # not hashed, so not part of what was handed in
    kept = [path.resolve() for path in secrets if path.exists()]
    secret += [path for path in kept if path != source.file and _within(path, [source.place])]
    entries = (path for path in sorted(source.place.iterdir()) if not is_ignored(path))
    own = tuple(path for path in entries if path not in secret)
    import_from = (*_user_site(), *required)
    return VisibleFiles(own, shared, (*hidden, *secret), import_from, source.place)


def _user_site() -> tuple[Path, ...]:
    """The user's own packages, if Python uses them; the child ignores the user's site."""
    return (Path(site.getusersitepackages()),) if site.ENABLE_USER_SITE else ()


def _shared() -> Iterator[Path]:
    """The system's folders, Python's, and ours; each once, and where it really is."""
    paths = sysconfig.get_paths()
    folders = [
        *SYSTEM,
        sys.prefix,
        sys.base_prefix,
        sys.exec_prefix,
        sys.base_exec_prefix,
        *(paths[name] for name in ("stdlib", "platstdlib", "purelib", "platlib")),
        *site.getsitepackages(),
        *map(str, _user_site()),
        str(Path(__file__).parents[1]),
        *(str(place) for place in [module_location(OURS)] if place),
    ]
    found = {Path(folder) for folder in folders} | {Path(folder).resolve() for folder in folders}
    yield from sorted(path for path in found if path.exists())


def _hidden() -> Iterator[Path]:
    place = module_location("real_bench.goals")
    if place is not None:
        yield place


def _within(path: Path, roots: Iterable[Path]) -> bool:
    return any(path.is_relative_to(root.resolve()) for root in roots)
