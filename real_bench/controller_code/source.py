"""Where a controller's code is, and its hash: found without running any of it."""

from __future__ import annotations

import hashlib
import importlib.util
import os
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache
from importlib.machinery import ModuleSpec
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any

from real_bench.controller_code.manifest import (
    MANIFEST,
    Submission,
    find_submission,
    read_submission,
)
from real_bench.errors import ControllerError
from real_bench.files.hashing import file_sha256
from real_bench.text.naming import CONTROLLER_FILE, shareable_name
from real_bench.text.nearest import did_you_mean

GROUP = "real_bench.controllers"
OURS = "real_bench.controllers"

CODE = frozenset({".py", ".so", ".pyd", ".pyx"})
MAX_ENTRIES = 20_000
"""A folder with more files below it is not a controller's own."""


@dataclass(frozen=True)
class ControllerSource:
    """A user's name for a controller, parsed.

    Attributes:
        spec: as the user wrote it.
        file: the file, if it is one.
        module: otherwise the module; for an installed controller the one that offers it.
        class_name: the class; empty if not given.
        submission: its manifest, if it is a submission.
        is_hashed: false in a sandbox, where the hash is not needed and some files are hidden.
    """

    spec: str
    file: Path | None
    module: str
    class_name: str
    submission: Submission | None = None
    is_hashed: bool = True

    @classmethod
    def of(cls, spec: str) -> ControllerSource:
        """Parse a name, ``module:Class``, ``path/to/file.py[:Class]`` or a submission's folder.

        Raises:
            ControllerError: there is no such file, or no installed controller of that name.
            SubmissionError: the submission is not valid.
        """
        if found := CONTROLLER_FILE.fullmatch(spec):
            file = Path(found["file"])
            if not file.is_file():
                raise ControllerError(f"controller file not found: {file}")
            return cls(spec, file.resolve(), "", found["name"] or "")
        if (folder := submission_folder(spec)) is not None:
            submission = read_submission(folder)
            return cls(spec, submission.file, "", submission.class_name, submission)
        module, _, class_name = spec.rpartition(":")
        if class_name and module:
            return cls(spec, None, module, class_name)
        offer = installed(spec)
        return cls(spec, None, offer.module, offer.attr)

    @cached_property
    def place(self) -> Path:
        """Everything it could import as its own: its file's folder, its package, or its module.

        Raises:
            ControllerError: there is no such module.
        """
        if self.file is not None:
            return self.file.parent
        top = OURS if self.module.startswith(OURS) else self.module.partition(".")[0]
        found = module_location(top)
        if found is None:
            raise ControllerError(f"controller {self.spec} cannot be loaded: no module {top}")
        return found

    @property
    def settings(self) -> dict[str, Any]:
        """The settings in a submission's manifest; empty for anything else."""
        return {} if self.submission is None else self.submission.settings

    @cached_property
    def code_sha256(self) -> str:
        """The hash of the file's or module's name, and of every code file in its place.

        For a submission, of every file except recordings, results and goals.
        """
        if not self.is_hashed:
            return ""
        digest = hashlib.sha256(
            f"{self.file.name if self.file else self.module}\n".encode(errors="surrogateescape")
        )
        for file in self.code_files():
            name = file.name if file == self.place else file.relative_to(self.place).as_posix()
            digest.update(f"{name}\0{file_sha256(file)}\n".encode(errors="surrogateescape"))
        return digest.hexdigest()

    def code_files(self) -> list[Path]:
        """Every code file in its place; raises ControllerError if there are too many."""
        if self.place.is_file():
            return [self.place]
        if self.submission is not None:
            return self.submitted_files()
        return sorted(file for file in self.files() if file.suffix in CODE)

    def submitted_files(self) -> list[Path]:
        """Every file in its place that is not the benchmark's; raises ControllerError."""
        from real_bench.controller_code.benchmark_files import is_benchmark_file  # loads numpy

        return sorted(file for file in self.files() if not is_benchmark_file(file))

    def files(self) -> Iterator[Path]:
        """Every file in its place, except caches of tools; raises ControllerError."""
        for number, path in enumerate(path for path, counts in _walk(self.place) if counts):
            if number == MAX_ENTRIES:
                raise ControllerError(
                    f"controller {self.spec}: more than {MAX_ENTRIES:,} files in "
                    f"{self.place}: put the controller in a folder of its own"
                )
            yield path


def is_ignored(path: Path) -> bool:
    """Whether something in a controller's folder does not count: links, and caches of tools."""
    return (
        path.is_symlink()
        or path.name.startswith(".")
        or path.name in ("__pycache__", "node_modules")
        or os.path.lexists(path / "pyvenv.cfg")  # no error where nobody may look
    )


def ignored_paths(folder: Path) -> Iterator[Path]:
    """What does not count in a controller's folder, except links; nothing that is within it."""
    for path, counts in _walk(folder):
        if not counts and not path.is_symlink():
            yield path


def _walk(folder: Path) -> Iterator[tuple[Path, bool]]:
    """Every file, and what is ignored: whether it counts."""
    for path in sorted(folder.iterdir()):
        if is_ignored(path):
            yield path, False
        elif path.is_dir():
            yield from _walk(path)
        elif path.is_file():
            yield path, True


def module_location(module: str) -> Path | None:
    """The file of a module, or the folder of a package; None if there is none."""
    try:
        found: ModuleSpec | None = importlib.util.find_spec(module)
    except (ImportError, ValueError):
        return None
    if found is None:
        return None
    if found.submodule_search_locations:
        return Path(next(iter(found.submodule_search_locations))).resolve()
    return Path(found.origin).resolve() if found.has_location and found.origin else None


def resolved(spec: str) -> str:
    """The controller as named from any folder: a file by its full path."""
    if (folder := submission_folder(spec)) is not None:
        return str(folder.resolve())
    found = CONTROLLER_FILE.fullmatch(spec)
    if not found:
        return spec
    return f"{Path(found['file']).resolve()}{found[2] or ''}"


def recorded_name(spec: str) -> str:
    """A controller's name in recordings and results: no folders; a submission ``folder:name``."""
    source = ControllerSource.of(spec)
    if source.submission is None:
        return shareable_name(spec)
    folder = submission_folder(spec)
    return f"{folder and folder.name}:{source.submission.name}"


def submission_folder(spec: str) -> Path | None:
    """The folder of a submission, named by it or as ``folder:name``; None for anything else.

    Raises:
        ControllerError: it is a folder or an archive, but not an unpacked submission.
    """
    if CONTROLLER_FILE.fullmatch(spec):
        return None
    found = find_submission(spec)
    if not (found or Path(spec).exists()) or is_installed(spec):
        return None
    if found:
        return found
    if spec.lower().endswith(".zip"):
        raise ControllerError(f"{spec} is packed: unpack it and name its folder")
    if Path(spec).is_dir():
        raise ControllerError(
            f"the folder {spec} has no {MANIFEST}: name a file in it, or make it a submission "
            f"(realbench submission init {spec})"
        )
    return None


def is_installed(spec: str) -> bool:
    """Whether it is the name of an installed controller: code that the user trusts already."""
    return spec in _offers()


def installed(name: str) -> EntryPoint:
    """Where an installed controller is; raises ControllerError if there is none of that name."""
    offers = _offers()
    if name not in offers:
        likely = [f"{name}.py"] if Path(f"{name}.py").is_file() else offers
        raise ControllerError(
            f"unknown controller {name!r}: use one of {', '.join(sorted(offers)) or '(none)'}, "
            "module:Class, path/to/file.py[:Class], or a submission's folder"
            f"{did_you_mean(name, likely)}"
        )
    return offers[name]


def _offers() -> dict[str, EntryPoint]:
    """Installed controllers, by name."""
    return _offers_at(tuple((folder, _changed_at(Path(folder))) for folder in sys.path))


def _changed_at(folder: Path) -> int:
    try:
        return folder.stat().st_mtime_ns
    except OSError:
        return 0


@lru_cache(maxsize=1)
def _offers_at(folders: tuple[tuple[str, int], ...]) -> dict[str, EntryPoint]:
    """The same, from the metadata of every package; read anew once a folder has changed."""
    return {offer.name: offer for offer in entry_points(group=GROUP)}


def has_code_hash(source: ControllerSource, sha256: str) -> bool:
    """Whether this is the code with that hash.

    Early recordings and results have the hash of the one file that defines the class.
    """
    if source.submission is not None:
        return source.code_sha256 == sha256
    return source.code_sha256 == sha256 or any(
        file_sha256(file) == sha256 for file in source.code_files()
    )
