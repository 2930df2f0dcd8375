"""The packages that a submission needs, in a folder of their own.

They come as wheels, so that installing runs none of their code, and must accept the versions of
our packages: a controller shares its process with numpy and our own code.
"""

from __future__ import annotations

import hashlib
import json
import logging
import subprocess
import sys
import sysconfig
from importlib.metadata import distributions
from pathlib import Path

from real_bench.errors import RealBenchError, SubmissionError
from real_bench.files import check_folder, file_sha256
from real_bench.locks import write_lock
from real_bench.submissions.manifest import WHEELS, Submission

SECONDS_TO_INSTALL = 1800
DONE = "installed.json"

UNREACHABLE = ("connection broken by", "Could not fetch URL")
"""What pip says, among else, if it gets no answer; then nobody knows whether a package exists."""

log = logging.getLogger(__name__)


class UnreachableError(RealBenchError):
    """No package can be installed now, which is no fault of a submission."""


def packages_of(submission: Submission) -> Path | None:
    """The folder of a submission's packages, installed if needed; None: it needs none.

    Raises:
        SubmissionError: they cannot be installed.
        UnreachableError: the package index does not answer.
        RealBenchError: they cannot be stored.
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
            _install(submission, ours, place)
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
        raise _install_error(submission, f"it took more than {SECONDS_TO_INSTALL:,} s") from error
    output = f"{done.stdout}\n{done.stderr}"
    if done.returncode and any(sign in output for sign in UNREACHABLE):
        raise UnreachableError(
            f"{submission.name}: the package index cannot be reached, so its requirements are not "
            f"installed: try again later ({_failure_reason(output)})"
        )
    if done.returncode:
        raise _install_error(submission, _failure_reason(output))


def _failure_reason(pip_output: str) -> str:
    """What pip says of its failure, in a line."""
    lines = [line.strip() for line in pip_output.splitlines() if line.strip()]
    conflict = [line for line in lines if " depends on " in line or "The user requested" in line]
    errors = [line.removeprefix("ERROR: ") for line in lines if line.startswith("ERROR: ")]
    return "; ".join(conflict or errors[:1] or lines[-1:] or ["pip says nothing"])


def _install_error(submission: Submission, why: str) -> SubmissionError:
    wanted = ", ".join(submission.requirements)
    return SubmissionError(
        f"{submission.name}: its requirements ({wanted}) cannot be installed: {why}"
    )
