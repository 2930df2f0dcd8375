"""The packages that a submission needs, in a folder of their own.

They come as wheels, so that installing runs none of their code, and must accept the versions of
our packages: a controller shares its process with numpy and our own code.
"""

from __future__ import annotations

import hashlib
import json
import logging
import re
import subprocess
import sys
import sysconfig
import zipfile
from importlib.metadata import distributions
from pathlib import Path

from real_bench.controller_code.manifest import WHEELS, Submission
from real_bench.controller_code.submission_faults import OUR_TROUBLE, as_submission_error
from real_bench.errors import RealBenchError, SubmissionError
from real_bench.files.hashing import file_sha256
from real_bench.files.locks import write_lock
from real_bench.files.outputs import check_folder

SECONDS_TO_INSTALL = 1800
DONE = "installed.json"

MAX_UNPACKED_BYTES = 16 * 2**30
"""Of a submission's own wheels."""

UNREACHABLE = ("WARNING: Retrying", "Could not fetch URL")
"""How lines of pip begin if it gets no answer; then nobody knows whether a package exists."""

_SYSTEM_ERROR = re.compile(
    r"(?:ERROR: Could not install packages due to an OSError|Error): \[Errno (\d+)\]"
)
"""How pip and venv begin a line about what the system refused."""

log = logging.getLogger(__name__)


class UnreachableError(RealBenchError):
    """No package can be installed now, which is no fault of a submission."""


def packages_of(submission: Submission) -> Path | None:
    """The folder of a submission's packages, installed if needed; None: it needs none.

    Raises:
        SubmissionError: they cannot be installed.
        UnreachableError: the package index does not answer, or there is no room for them.
        RealBenchError: there is no folder for them.
    """
    if not submission.requirements:
        return None
    ours = _our_versions()
    place = _root() / _key(submission, ours)
    packages = Path(_paths(place)["purelib"])
    if (place / DONE).exists():
        return packages
    check_folder(place, make=True)
    wanted = ", ".join(submission.requirements)
    with write_lock(place / DONE, wait_while=f"installs {wanted}"):
        if not (place / DONE).exists():
            log.info("installing %s for %s", wanted, submission.name)
            try:
                _install(submission, ours, place)
            except OSError as error:
                raise _not_now(submission, str(error)) from error
    return packages


def _root() -> Path:
    import platformdirs

    try:
        return Path(platformdirs.user_cache_dir("realbench", appauthor=False)) / "requirements"
    except RuntimeError as error:  # no home
        raise RealBenchError(
            f"no folder to install packages in: {error} (set XDG_CACHE_HOME)"
        ) from error


def _key(submission: Submission, ours: dict[str, str]) -> str:
    """A name for the folder of these packages."""
    wheels = {wheel.name: file_sha256(wheel) for wheel in submission.wheels}
    facts = [sorted(submission.requirements), wheels, ours, sys.version, sysconfig.get_platform()]
    return hashlib.sha256(json.dumps(facts).encode()).hexdigest()[:32]


def _our_versions() -> dict[str, str]:
    """The version of every package that is installed here."""
    found = {each.metadata["Name"]: each.version for each in distributions()}
    return dict(sorted((name, version) for name, version in found.items() if name))


def _install(submission: Submission, ours: dict[str, str], place: Path) -> None:
    """Let pip install them into an environment that sees our packages but cannot change them."""
    _check_unpacked_size(submission)
    paths = _paths(place)
    _run([sys.executable, "-m", "venv", "--without-pip", "--clear", paths["data"]], submission)
    site = Path(paths["purelib"])
    (site / "realbench.pth").write_text("\n".join(_our_folders()) + "\n")
    (place / "constraints.txt").write_text(
        "".join(f"{name}=={version}\n" for name, version in ours.items() if "+" not in version)
    )
    own = ["--no-index", "--find-links", str(submission.folder / WHEELS)]
    _run(
        [
            *(sys.executable, "-m", "pip", "--python", paths["scripts"] + "/python"),
            *("install", "--no-input", "--disable-pip-version-check"),
            *("--only-binary", ":all:", "--constraint", str(place / "constraints.txt")),
            *(own if submission.wheels else ()),
            *("--", *submission.requirements),
        ],
        submission,
    )
    (place / DONE).write_text(json.dumps(submission.requirements))


def _check_unpacked_size(submission: Submission) -> None:
    n_bytes = 0
    for wheel in submission.wheels:
        with as_submission_error(f"{wheel.name} cannot be read"), zipfile.ZipFile(wheel) as archive:
            n_bytes += sum(entry.file_size for entry in archive.infolist())
    if n_bytes > MAX_UNPACKED_BYTES:
        limit = f"{MAX_UNPACKED_BYTES >> 20:,} MiB"
        raise _install_error(submission, f"its wheels unpack to more than {limit}")


def _paths(place: Path) -> dict[str, str]:
    environment = str(place / "environment")
    names = {"base": environment, "platbase": environment}
    scheme = "venv" if "venv" in sysconfig.get_scheme_names() else "posix_prefix"  # Python 3.10
    return sysconfig.get_paths(scheme=scheme, vars=names)


def _our_folders() -> list[str]:
    paths = sysconfig.get_paths()
    return list(dict.fromkeys([paths["purelib"], paths["platlib"]]))


def _run(command: list[str], submission: Submission) -> None:
    try:
        done = subprocess.run(
            command,
            capture_output=True,
            text=True,
            check=False,
            timeout=SECONDS_TO_INSTALL,
            stdin=subprocess.DEVNULL,
        )
    except subprocess.TimeoutExpired as error:
        took = f"it took more than {SECONDS_TO_INSTALL:,} s"
        blamed = _install_error if submission.wheels else _not_now  # own wheels wait for nobody
        raise blamed(submission, took) from error
    if done.returncode:
        output = f"{done.stdout}\n{done.stderr}"
        raise _error(submission, [line.strip() for line in output.splitlines() if line.strip()])


def _error(submission: Submission, lines: list[str]) -> RealBenchError:
    """Whose fault it is by what pip says, whose every line may quote what wheels say."""
    why = _failure_reason(lines)
    refused = {int(found[1]) for line in lines if (found := _SYSTEM_ERROR.match(line))}
    if refused & OUR_TROUBLE:
        return _not_now(submission, why)
    if not submission.wheels and any(line.startswith(UNREACHABLE) for line in lines):
        return _not_now(submission, f"the package index cannot be reached: {why}")
    return _install_error(submission, why)


def _failure_reason(lines: list[str]) -> str:
    """What pip says of its failure, in a line."""
    conflict = [line for line in lines if " depends on " in line or "The user requested" in line]
    errors = [line.removeprefix("ERROR: ") for line in lines if line.startswith("ERROR: ")]
    return "; ".join(conflict or errors[:1] or lines[-1:] or ["pip says nothing"])


def _not_now(submission: Submission, why: str) -> UnreachableError:
    return UnreachableError(
        f"{submission.name}: its requirements are not installed, through no fault of its own: try "
        f"again later ({why})"
    )


def _install_error(submission: Submission, why: str) -> SubmissionError:
    wanted = ", ".join(submission.requirements)
    return SubmissionError(
        f"{submission.name}: its requirements ({wanted}) cannot be installed: {why}"
    )
