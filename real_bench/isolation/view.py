"""What of the file system an isolated controller sees: Python, its packages, its own files."""

from __future__ import annotations

import importlib.util
import site
import sys
import sysconfig
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from importlib.machinery import ModuleSpec
from pathlib import Path

from real_bench.errors import ControllerError
from real_bench.files import file_sha256
from real_bench.finding import code_beside, installed

SYSTEM = (
    "/usr",
    "/bin",
    "/lib",
    "/lib32",
    "/lib64",
    "/etc/alternatives",
    "/etc/ld.so.cache",
    "/etc/localtime",
    "/sys/devices/system/cpu",  # how many cores there are, which decides how sums are split
)


@dataclass(frozen=True)
class View:
    """Paths that are seen, read-only, at the places where they are.

    Attributes:
        own: the files and folders that the controller came with.
        shared: Python, its packages, and the system's libraries.
        hidden: folders among these that are not seen: goals that ship with us.
        import_from: folders to import from beside Python's own.
    """

    own: tuple[Path, ...]
    shared: tuple[Path, ...]
    hidden: tuple[Path, ...]
    import_from: tuple[Path, ...] = ()

    def check_hides(self, secrets: Iterable[Path]) -> None:
        """Raise ControllerError where the controller would see one of these."""
        for secret in secrets:
            place = secret.resolve()
            if _within(place, self.hidden):
                continue
            if _within(place, self.own) or _within(place, self.shared):
                raise ControllerError(
                    f"{secret} lies where an isolated controller may read: keep it outside of "
                    "the controller's package, of Python and of the system's folders"
                )

    def source_sha256(self, claimed: str) -> str:
        """The hash of the file that the controller says defines it; empty if it is not its own."""
        file = Path(claimed)
        own = claimed != "" and _within(file.resolve(), self.own) and file.is_file()
        return file_sha256(file) if own else ""


def view_of(spec: str) -> View:
    """What the controller that ``spec`` names sees; found without importing any of it.

    Of the folder in which a controller's file lies it sees the Python files and the packages: not
    recordings, goals or results that lie there, nor what is put there later.

    Raises:
        ControllerError: there is no such file, module or name.
    """
    target, _, class_name = spec.partition(":")
    shared, hidden = tuple(_shared()), tuple(_hidden())
    if target.endswith(".py"):
        file = Path(target).resolve()
        if not file.is_file():
            raise ControllerError(f"the controller file {target} does not exist")
        return View((file, *code_beside(file)), shared, hidden, _user_site())
    module = target if class_name else installed(spec).module
    place = _place_of(module, spec)
    elsewhere = () if _within(place, shared) else (place.parent,)
    return View((place,), shared, hidden, (*_user_site(), *elsewhere))


def _place_of(module: str, spec: str) -> Path:
    """The file of a module, or the folder of the package that it is in."""
    ours = "real_bench.controllers"
    top = ours if module.startswith(ours) else module.partition(".")[0]
    found = _find(top)
    if found is None:
        raise ControllerError(f"controller {spec} cannot be loaded: there is no module {top}")
    return found


def _find(module: str) -> Path | None:
    try:
        found: ModuleSpec | None = importlib.util.find_spec(module)
    except (ImportError, ValueError):
        return None
    if found is None:
        return None
    if found.submodule_search_locations:
        return Path(next(iter(found.submodule_search_locations))).resolve()
    return Path(found.origin).resolve() if found.has_location and found.origin else None


def _user_site() -> tuple[Path, ...]:
    """The user's own packages, where Python uses them; the child is told to ignore the user."""
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
        *(str(place) for place in [_find("real_bench.controllers")] if place),
    ]
    found = {Path(folder) for folder in folders} | {Path(folder).resolve() for folder in folders}
    yield from sorted(path for path in found if path.exists())


def _hidden() -> Iterator[Path]:
    place = _find("real_bench.goals")
    if place is not None:
        yield place


def _within(path: Path, roots: Iterable[Path]) -> bool:
    return any(path.is_relative_to(root.resolve()) for root in roots)
