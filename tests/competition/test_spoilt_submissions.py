"""Whatever is wrong with a submission, it is refused with a reason, and all others are taken in."""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
from collections.abc import Iterator
from datetime import datetime, timezone
from itertools import islice
from pathlib import Path

import pytest

from real_bench.competition.checking import SubmissionCheck
from real_bench.competition.entries import Entry, read_entries
from real_bench.competition.standing import Standing
from real_bench.controller_code.benchmark_files import is_benchmark_file
from real_bench.controller_code.packing import pack
from real_bench.controller_code.source import ControllerSource
from tests.cli.shell import realbench
from tests.competition.five import GOOD, rounds, submission
from tests.competition.spoilt import SPOILT, packed

ROOT_READS_IT = [name for name in SPOILT if name.startswith("unreadable") and os.geteuid() == 0]
MADE = [name for name in SPOILT if name not in ROOT_READS_IT]


@pytest.fixture
def handed_in(tmp_path: Path) -> Iterator[Path]:
    """A folder for submissions, which may be too deep for Python to remove."""
    place = tmp_path / "submissions"
    submission(place / "good", GOOD)
    yield place
    subprocess.run(["chmod", "-R", "u+rwx", place], check=False)
    subprocess.run(["rm", "-rf", place], check=True)


def taken_in(handed_in: Path, kept: Path) -> dict[str, Entry]:
    """All entries by key, each of which can be kept as a round keeps it."""
    entries = read_entries(handed_in, kept / "results", "OM")
    for entry in entries:
        home = kept / "results" / "first" / entry.version
        home.mkdir(parents=True)
        entry.standing.save(home)
        assert Standing.load(home) == entry.standing
    return {entry.standing.key: entry for entry in entries}


@pytest.mark.parametrize("name", MADE)
def test_spoilt_submission_is_refused_and_stops_no_other(
    handed_in: Path, tmp_path: Path, name: str
) -> None:
    spoil, told = SPOILT[name]
    spoil(handed_in / name)
    entries = taken_in(handed_in, tmp_path)
    assert entries["good"].standing.status == "waiting"
    refused = entries[name].standing
    assert (refused.status, entries[name].folder) == ("refused", None)
    assert told in refused.detail
    assert str(tmp_path) not in refused.detail
    assert "realbench-entry-" not in refused.detail
    (place,) = (path for path in handed_in.iterdir() if path.name.startswith(name))
    done = realbench(tmp_path, "submission", "check", place, code=3)
    assert told in done.stdout.splitlines()[-1]
    assert done.stdout.splitlines()[-1].startswith("NO  fails ")
    assert "Traceback" not in done.stderr


def test_round_with_spoilt_submissions_scores_the_good_one(place: Path, handed_in: Path) -> None:
    for name in MADE:
        SPOILT[name][0](handed_in / name)
    path = rounds(place, play="none", trial_steps=500)
    realbench(place, "round", "run", handed_in, path)
    told = realbench(place, "leaderboard", "results", "--format", "json").stdout
    rows = {row["key"]: row["status"] for row in json.loads(told)["first"]["rows"]}
    assert rows == {"good": "scored", **dict.fromkeys(MADE, "refused")}


def test_nothing_handed_in_is_left_out_without_a_word(
    handed_in: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An archive is unpacked beside the results, since the system's place may be small."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "nowhere"))
    packed(handed_in / "upper").rename(handed_in / "UPPER.ZIP")
    packed(handed_in / "good")
    for name in ("a b", "a_b"):
        submission(handed_in / name, GOOD)
    (submission(handed_in / "venv", GOOD) / "pyvenv.cfg").touch()
    for name in ("notes.tar.gz", ".notes"):
        (handed_in / name).touch()
    (handed_in / "link").symlink_to(handed_in / "good")
    entries = {key.partition(",")[0]: entry for key, entry in taken_in(handed_in, tmp_path).items()}
    details = {key: entry.standing.detail for key, entry in entries.items()}
    assert details.pop("good") == "good has the same name: rename one"
    assert details.pop("venv") == details.pop("link")
    assert details.pop("notes.tar.gz") == "it is neither a folder nor a zip"
    assert set(details.values()) == {""}
    assert len(details) == len({"UPPER", "a b", "a_b"})


def test_copy_of_a_submission_is_the_one_that_was_handed_in(
    handed_in: Path, tmp_path: Path
) -> None:
    copy = taken_in(handed_in, tmp_path)["good"].folder
    assert copy is not None
    whole = (copy / "controller.py").read_bytes()
    (copy / "controller.py").write_bytes(whole[:100])
    assert read_entries(handed_in, tmp_path / "results", "OM")[0].folder == copy
    assert (copy / "controller.py").read_bytes() == whole
    (copy / "submission.yaml").unlink()
    read_entries(handed_in, tmp_path / "results", "OM")
    assert (copy / "submission.yaml").exists()


def test_submission_called_like_an_installed_controller_is_not_taken_for_it(
    handed_in: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = submission(handed_in / "real_r", GOOD)
    sha256 = ControllerSource.of(str(folder)).code_sha256
    monkeypatch.chdir(handed_in)
    assert len(pack(Path("real_r"), tmp_path / "mine.zip")) == 2
    *_, told = islice(SubmissionCheck(Path("real_r")).findings(), 3)
    assert told.detail == f"{sha256} over 2 files"
    entries = read_entries(Path(), tmp_path / "results", "OM")
    assert entries[1].standing.sha256 == sha256
    assert entries[1].folder is not None


@pytest.mark.parametrize(
    "name", [b"caf\xe9", "東京".encode(), b"a" * 250, b"a b", b"[red]*x*", b"controller.py"]
)
def test_odd_names_of_folders_are_no_reason_to_stop(
    handed_in: Path, tmp_path: Path, name: bytes
) -> None:
    submission(handed_in / os.fsdecode(name), GOOD, name="Odd")
    submission(handed_in / os.fsdecode(b"x" + name[1:]), GOOD, name="Other")
    (handed_in / os.fsdecode(b"broken-" + name[:240])).mkdir()
    entries = taken_in(handed_in, tmp_path)
    assert len(entries) == 4
    assert entries["good"].standing.status == "waiting"


@pytest.mark.parametrize("moment", [-(2**40), 2**33, 2**40])
def test_odd_dates_of_files_are_no_reason_to_stop(
    handed_in: Path, tmp_path: Path, moment: int
) -> None:
    for file in submission(handed_in / "odd", GOOD).iterdir():
        os.utime(file, (moment, moment))
    entries = taken_in(handed_in, tmp_path)
    assert entries["odd"].standing.status == "waiting"
    now = datetime.now(timezone.utc).isoformat(timespec="seconds")
    assert "1970" <= entries["odd"].standing.date <= now


@pytest.mark.parametrize("method", [12, 14])  # bzip2, LZMA
def test_file_of_any_compression_is_looked_at_without_error(tmp_path: Path, method: int) -> None:
    assert not is_benchmark_file(packed(tmp_path / "whole", method=method))
    path = packed(tmp_path / "broken", method=method)
    content = bytearray(path.read_bytes())
    content[45:70] = bytes(25)
    path.write_bytes(content)
    assert not is_benchmark_file(path)
