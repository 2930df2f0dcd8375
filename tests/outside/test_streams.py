"""Standard streams, homes and names as they may be: one line, and never a traceback."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from real_bench.scoring.result import load_result
from tests.cli.shell import COMMAND, realbench
from tests.outside.bench import ROOT, check_readable_to_all

BIN = str(COMMAND)
DOCTOR = "doctor --scene builtin"


def shell(folder: Path, line: str, **environment: str | None) -> subprocess.CompletedProcess[str]:
    """A line of shell, in which $R is the command."""
    known = {**os.environ, "R": BIN, **environment}
    env = {name: value for name, value in known.items() if value is not None}
    return subprocess.run(
        ["bash", "-c", line], cwd=folder, env=env, capture_output=True, text=True, timeout=300,
        errors="surrogateescape",
    )  # fmt: skip


@pytest.mark.parametrize("asked", ["inspect run.h5", "inspect run.h5 --json", "--help"])
def test_full_disk_behind_standard_output_is_reported(place: Path, asked: str) -> None:
    done = shell(place, f"$R {asked} > /dev/full")
    assert done.returncode == 1
    assert done.stderr == "realbench: error: No space left on device\n"


def test_full_disk_behind_standard_error_exits_with_1(place: Path) -> None:
    assert shell(place, "$R inspect none.h5 2> /dev/full").returncode == 1
    assert shell(place, "$R inspect none.h5 > /dev/full 2>&1").returncode == 1


@pytest.mark.parametrize(
    ("asked", "closed"),
    [
        *(("inspect run.h5", closed) for closed in ("<&-", ">&-", "2>&-", "<&- >&- 2>&-")),
        *((DOCTOR, closed) for closed in ("2>&-", "<&- >&- 2>&-")),
    ],
)
def test_closed_streams_are_ignored(place: Path, asked: str, closed: str) -> None:
    """What is printed there is lost, as asked for; all else is as ever."""
    done = shell(place, f"$R {asked} {closed}")
    assert (done.returncode, done.stderr) == (0, "")
    assert ("real-bench" in done.stdout) == (">&-" not in closed or closed == "2>&-")


def test_recording_is_intact_where_streams_are_closed(place: Path) -> None:
    play = "intrinsic --controller real_r --condition OM --scene builtin --steps 1000"
    done = shell(place, f"$R {play} --out new.h5 <&- >&- 2>&-")
    assert done.returncode == 0
    assert shell(place, "$R inspect new.h5").returncode == 0


def test_reader_that_leaves_early_causes_no_error(place: Path) -> None:
    done = shell(place, "$R inspect run.h5 | head -1")
    assert done.stdout.startswith("file")
    assert done.stderr == ""


@pytest.mark.parametrize(
    "asked",
    ["compare score.json score2.json", "table tiny.yaml --no-run", "inspect run.h5", "--help"],
)
@pytest.mark.parametrize(
    "terminal", [{"PYTHONIOENCODING": "ascii"}, {"LC_ALL": "C", "PYTHONUTF8": "0",
                 "PYTHONCOERCECLOCALE": "0"}], ids=["ascii", "C"],
)  # fmt: skip
def test_ascii_terminal_gets_ascii_output(
    place: Path, terminal: dict[str, str], asked: str
) -> None:
    result = load_result(place / "score.json")
    setting = result.setting.model_copy(update={"seed": 7})
    result.model_copy(update={"setting": setting}).save(place / "score2.json")
    done = shell(place, f"$R {asked}", **terminal)
    assert done.returncode == 0, done.stderr
    assert done.stdout.isascii()


def test_missing_home_is_reported_only_where_it_is_needed(place: Path) -> None:
    """A user of a number that nobody has, as containers give it."""
    if not ROOT:
        pytest.skip("only root may be another user")
    check_readable_to_all()
    as_other = "setpriv --reuid=54321 --clear-groups"
    listed = shell(place, f"{as_other} $R scene list", HOME=None, XDG_DATA_HOME=None)
    assert listed.returncode == 0, listed.stderr
    assert "official: no folder to install scene official in: set HOME" in listed.stdout
    asked = shell(place, f"{as_other} $R doctor", HOME=None, XDG_DATA_HOME=None)
    assert asked.returncode == 1
    assert asked.stderr.startswith("realbench: error: no folder to install scene official")
    assert asked.stderr.count("\n") == 1
    play = "intrinsic --controller real_r --condition OM --scene builtin --steps 1000"
    (place / "open").mkdir()
    (place / "open").chmod(0o777)
    played = shell(place / "open", f"{as_other} $R {play}", HOME=None)
    assert played.returncode == 0, played.stderr


@pytest.fixture
def odd(place: Path) -> Path:
    """A folder whose name is not UTF-8, with all the material in it."""
    folder = place / os.fsdecode(b"caf\xe9")
    folder.mkdir()
    for file in place.iterdir():
        if file.is_file():
            (folder / file.name).write_bytes(file.read_bytes())
    (folder / "mine.py").write_text(
        "from real_bench.controllers.real_r import RealR\nclass Mine(RealR): pass\n"
    )
    return folder


PLAY = "intrinsic --controller {} --condition OM --scene builtin --steps 1000 --out new.h5"
TEST = (
    "extrinsic --controller {} --condition OM --scene builtin --goals goals.npy --trials 1"
    " --trial-steps 500"
)


@pytest.mark.parametrize(
    "asked",
    [
        "inspect $PWD/run.h5",
        "inspect run.h5 --json",
        "verify $PWD/score.json --goals $PWD/goals.npy --allow-incomplete",
        PLAY.format("real_r"),
        TEST.format("mine.py") + " --out new.json",
        "report $PWD/score.json --goals $PWD/goals.npy --out report.html",
        "goals show $PWD/goals.npy",
    ],
)
def test_folder_name_that_is_not_utf_8_is_accepted(odd: Path, asked: str) -> None:
    done = realbench(odd, *asked.replace("$PWD", str(odd)).split())
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    "asked", [PLAY.format("mine.py"), TEST.format("$PWD/mine.py") + " --out new.json"]
)
def test_unrecordable_controller_path_is_refused_before_work_begins(odd: Path, asked: str) -> None:
    done = realbench(odd, *asked.replace("$PWD", str(odd)).split(), code=1)
    (fault,) = [line for line in done.stderr.splitlines() if "error" in line]
    assert fault.startswith("realbench: error: a re")
    assert "rename" in fault
    assert not list(odd.glob("new.*"))


def test_report_shows_a_file_name_that_is_not_text(odd: Path) -> None:
    (odd / os.fsdecode(b"\xff.h5")).write_bytes((odd / "run.h5").read_bytes())
    realbench(odd, "report", os.fsdecode(b"\xff.h5"), "--out", "report.html")
    assert "<h3>?.h5</h3>" in (odd / "report.html").read_text(encoding="utf-8")


def test_package_runs_with_python_m(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "real_bench", "--help"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0
    assert "Usage: realbench [OPTIONS]" in done.stdout
