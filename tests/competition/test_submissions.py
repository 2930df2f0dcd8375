from __future__ import annotations

import json
import logging
import stat
import sys
import tempfile
import zipfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Barrier
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from junitparser import Failure, JUnitXml

from real_bench.controller_code import requirements
from real_bench.controller_code.manifest import read_submission
from real_bench.controller_code.packing import MAX_BYTES, pack, unpack
from real_bench.controller_code.requirements import UnreachableError, packages_of
from real_bench.controller_code.source import ControllerSource
from real_bench.errors import ControllerError, RealBenchError, SubmissionError
from real_bench.recording import Recording
from real_bench.sandbox.limits import TEMPORARY_BYTES
from real_bench.scoring.result import load_result
from tests.cli.shell import realbench
from tests.competition.five import CRASHING, GOOD, HANGING, derived, submission
from tests.competition.wheels import NAME, wheel

NAMES = st.text("abcdefg", min_size=1, max_size=4)
CONTENTS = st.dictionaries(NAMES, st.binary(max_size=50), max_size=4)


def sha256(folder: Path) -> str:
    return ControllerSource.of(str(folder)).code_sha256


def test_new_submission_passes_its_check_unchanged(place: Path) -> None:
    realbench(
        place, "submission", "init", "mine", "--name", "Push 🤖, see", "--author", "A. Turing"
    )
    done = realbench(place, "submission", "pack", "mine")
    assert f"hash {sha256(place / 'mine')}" in done.stdout
    done = realbench(place, "submission", "check", "mine.zip", "--junit", "j.xml")
    assert "ok  says      Push 🤖, see, by A. Turing, for OM" in done.stdout
    assert "ok  plays " in done.stdout
    assert done.stdout.count("ok ") == 10
    suite = next(iter(JUnitXml.fromfile(str(place / "j.xml"))))
    assert suite.failures == suite.errors == 0
    assert suite.time > 0
    again = realbench(place, "submission", "init", "mine", code=3)
    assert "exists: use another folder" in again.stderr
    assert "mine.zip exists" in realbench(place, "submission", "pack", "mine", code=1).stderr


def without_method(code: str, *names: str) -> str:
    """The code of a controller whose methods of these names have other ones."""
    for name in names:
        code = code.replace(f"def {name}(", f"def no_{name}(")
    return code


def test_submission_that_forgets_its_play_fails_unless_it_need_not_play(place: Path) -> None:
    """As a round in which it plays would refuse it, but only after its play."""
    code = without_method(GOOD, "get_state", "set_state")
    submission(place / "mine", code)
    done = realbench(place, "submission", "check", "mine", code=3)
    told = done.stdout.splitlines()[-1]
    assert told.startswith("NO  state ")
    assert "define get_state() and set_state(), or use_experience()" in told
    realbench(place, "submission", "check", "mine", "--play", "none")
    learning = code + "\n    def use_experience(self, experience):\n        pass\n"
    submission(place / "learning", learning)
    done = realbench(place, "submission", "check", "learning")
    assert "ok  state     learns from the recording" in done.stdout
    assert "define get_state" not in realbench(place, "check", "mine").stdout


def test_largest_submission_leaves_room_in_the_folder_that_it_works_in() -> None:
    assert MAX_BYTES <= 3 / 4 * TEMPORARY_BYTES


def test_archive_has_the_whole_name_of_its_folder(place: Path) -> None:
    for version in ("v1", "v2"):
        submission(place / f"team.{version}", GOOD)
        realbench(place, "submission", "pack", f"team.{version}")
    assert {path.name for path in place.glob("*.zip")} == {"team.v1.zip", "team.v2.zip"}


def test_same_requirements_are_installed_once_by_two_at_the_same_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    wheel(submission(tmp_path / "mine", GOOD, requirements=[NAME]) / "wheels")
    mine = read_submission(tmp_path / "mine")
    with caplog.at_level(logging.INFO), ThreadPoolExecutor() as pool:
        begin = Barrier(2)
        futures = [pool.submit(lambda: (begin.wait(), packages_of(mine))[1]) for _ in range(2)]
        packages = {future.result() for future in futures}
    assert len(packages) == 1
    assert (packages.pop() or Path()).is_dir()
    assert [record.message for record in caplog.records if NAME in record.message] == [
        *sorted([f"installing {NAME} for Mine", f"waiting while another process installs {NAME}"])
    ]


def test_check_finds_what_would_fail_after_hours_of_play(place: Path) -> None:
    """As in the last hook of a test; tests/phases/test_checking.py has the others."""
    broken = (
        "\n    def end_extrinsic_trial(self, observation, reward, done):\n        self.misspelt\n"
    )
    submission(place / "mine", GOOD + broken)
    done = realbench(place, "submission", "check", "mine", code=3)
    assert "mine: end_extrinsic_trial() failed at " in done.stdout


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"name": "a:b"}, "name: "),
        ({"authors": []}, "authors: "),
        ({"entry": "../other.py"}, "entry: "),
        ({"entry": "none.py"}, "entry: file not found: none.py"),
        ({"condition": "XY"}, "condition: "),
        ({"requirements": ["not a requirement!"]}, "requirements: "),
        ({"requirements": ["a @ https://example.org/a.whl"]}, "not an address"),
        ({"requirements": ["-r other.txt"]}, "requirements: "),
        ({"setings": {}}, "setings: unknown name, did you mean settings?"),
        ({"settings": {"levels": 3}}, "has no settings, got levels"),
    ],
)
def test_bad_manifest_is_reported_with_exit_code_3(
    place: Path, changes: dict[str, Any], told: str
) -> None:
    submission(place / "bad", GOOD, **changes)
    done = realbench(place, "submission", "check", "bad", "--junit", "j.xml", code=3)
    assert told in done.stdout
    assert done.stdout.splitlines()[-1].startswith("NO  fails ")
    cases = next(iter(JUnitXml.fromfile(str(place / "j.xml"))))
    assert [type(each) for case in cases for each in case.result] == [Failure]


def test_hanging_submission_is_reported_in_time(place: Path) -> None:
    submission(place / "bad", derived(HANGING), entry="controller.py:Hanging")
    options = ["--call-limit", "10"]
    done = realbench(place, "submission", "check", "bad", *options, code=3)
    assert "next_action() did not end within the 10 s of --call-limit" in done.stdout
    code = "import time\ntime.sleep(1e6)\n"
    submission(place / "worse", code + GOOD)
    done = realbench(place, "submission", "check", "worse", *options, code=3)
    assert "its import did not end within the 10 s of --call-limit" in done.stdout


@settings(max_examples=30, deadline=None)
@given(files=CONTENTS, changed=NAMES, content=st.binary(min_size=51, max_size=60))
def test_hash_covers_every_file_and_survives_packing(
    files: dict[str, bytes], changed: str, content: bytes
) -> None:
    """Packing keeps it; any file that is changed or added gives another one."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = submission(Path(temporary) / "one", GOOD)
        for name, data in files.items():
            (folder / name).write_bytes(data)
        before = sha256(folder)
        archive = Path(temporary) / "one.zip"
        pack(folder, archive)
        packed = archive.read_bytes()
        pack(folder, archive)
        assert archive.read_bytes() == packed
        unpack(archive, Path(temporary) / "two")
        assert sha256(Path(temporary) / "two") == before
        (folder / changed).write_bytes(content)
        assert sha256(folder) != before


def test_playing_in_its_folder_does_not_change_the_hash(place: Path) -> None:
    """So that one who plays there can be tested; caches and recordings are not packed."""
    folder = submission(place / "mine", GOOD)
    before = sha256(folder)
    play = ["--controller", ".", "--scene", "builtin", "--steps", "1000"]
    realbench(folder, "intrinsic", *play)
    assert (folder / "run.h5").exists()
    assert sha256(folder) == before
    assert {path.name for path in pack(folder, place / "m.zip")} == {
        "controller.py",
        "submission.yaml",
    }
    goals = ["--goals", place / "goals.npy", "--trial-steps", "500"]
    realbench(folder, "extrinsic", *goals)


def test_submission_folder_works_as_controller_everywhere(place: Path) -> None:
    """Its name stands in the files and in the tables, its condition and settings are taken."""
    settings = {"levels": 9}
    code = "from real_bench.controllers.real_d import RealD\nclass Mine(RealD):\n    pass\n"
    submission(
        place / "mine", code, name="Plan it", settings={"abstraction": settings}, condition="OM"
    )
    play = ["--controller", "mine", "--scene", "builtin", "--steps", "2000"]
    for isolation in ("--isolate", "--no-isolate"):
        realbench(place, "intrinsic", *play, isolation, "--overwrite")
        with Recording(place / "run.h5") as recording:
            assert recording.header.controller == "mine:Plan it"
            assert recording.header.condition == "OM"
            assert recording.header.settings["abstraction"]["levels"] == 9
        test = ["--goals", "goals.npy", "--trial-steps", "500", "--overwrite", isolation]
        done = realbench(place, "extrinsic", "--controller", "mine", *test)
        assert "Plan it" in done.stdout or "score.json" in done.stdout
        result = load_result(place / "score.json")
        assert result.setting.controller == "mine:Plan it"
        assert result.setting.controller_sha256 == sha256(place / "mine")
    assert "## Plan it" in realbench(place, "score", "score.json", code=3).stdout
    verified = realbench(
        place, "verify", "score.json", *("--goals", "goals.npy", "--controller", "mine")
    )
    assert "verified: 3 of 3 trials" in verified.stdout
    assert "realbench intrinsic --controller mine" in realbench(place, "check", "mine").stdout
    (place / "table.yaml").write_text(
        "scene: builtin\nsteps: 1000\ntrial_steps: 500\ngoals: {few: goals.npy}\n"
        "cells: [{controller: mine, condition: OM}]\n"
    )
    limits = ["--isolate", "--call-limit", "60"]
    assert "Plan it" in realbench(place, "table", "table.yaml", *limits).stdout


@pytest.mark.parametrize("isolation", ["--isolate", "--no-isolate"])
def test_requirements_are_installed_from_its_own_wheels(
    place: Path, isolation: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    code = f"import {NAME}\nassert {NAME}.VALUE == 7\n{GOOD}"
    folder = submission(place / "mine", code, requirements=[f"{NAME}>=1"])
    wheel(folder / "wheels")
    play = ["--controller", "mine", "--scene", "builtin", "--steps", "1000", isolation]
    done = realbench(place, "intrinsic", *play)
    assert f"installing {NAME}>=1 for Mine" in done.stderr
    again = realbench(place, "intrinsic", *play, "--overwrite")
    assert "installing" not in again.stderr


@pytest.mark.parametrize(
    ("requires", "told"),
    [
        ("numpy<1.0", "numpy"),
        ('nobody-has-it; platform_version != "connection broken by"', "nobody-has-it"),
    ],
)
def test_requirements_that_cannot_be_installed_are_refused(
    place: Path, requires: str, told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What would change our numpy is no requirement that can be met."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    folder = submission(place / "mine", GOOD, requirements=[NAME])
    wheel(folder / "wheels", requires=requires)
    done = realbench(place, "submission", "check", "mine", code=3)
    assert "cannot be installed: " in done.stdout
    assert told in done.stdout.partition("cannot be installed: ")[2]


NO_ROOM = "Could not install packages due to an OSError: [Errno 28] No space left on device"


@pytest.mark.parametrize(
    ("says", "own", "others"),
    [
        (f"print('ERROR: {NO_ROOM}')", UnreachableError, UnreachableError),
        (f"print('ERROR: No match for x; {NO_ROOM}')", SubmissionError, SubmissionError),
        ("print('  WARNING: Retrying (...)')", SubmissionError, UnreachableError),
        ("print('ERROR: no x; WARNING: Retrying')", SubmissionError, SubmissionError),
        ("import time; time.sleep(60)", SubmissionError, UnreachableError),
    ],
)
def test_reason_of_pip_tells_whose_fault_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, says: str, own: type, others: type
) -> None:
    """A package index that does not answer is nobody's fault, except where none is asked."""
    monkeypatch.setattr(requirements, "SECONDS_TO_INSTALL", 1 if "sleep" in says else 60)
    command = [sys.executable, "-S", "-c", f"{says}; raise SystemExit(1)"]
    folder = submission(tmp_path / "mine", GOOD, requirements=[NAME])
    for expected in (others, own):
        with pytest.raises(RealBenchError) as caught:
            requirements._run(command, read_submission(folder))
        assert caught.type is expected
        wheel(folder / "wheels")


def test_wheels_that_would_fill_the_disk_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(requirements, "MAX_UNPACKED_BYTES", 2**20)
    folder = submission(tmp_path / "mine", GOOD, requirements=[NAME])
    wheel(folder / "wheels", code="#" * 2**21)
    with pytest.raises(SubmissionError, match="unpack to more than 1 MiB"):
        packages_of(read_submission(folder))


def test_exit_codes_tell_whose_fault_it_is(place: Path) -> None:
    """3: the submission is bad; 4: the controller failed; 1, 2: the job is broken."""
    test = ["--scene", "builtin", "--condition", "OM", "--goals", "goals.npy"]
    cases = ["--junit", "j.xml", "--overwrite"]
    submission(place / "missing", "import nobody_has_it\n" + GOOD)
    submission(place / "crashing", derived(CRASHING), entry="controller.py:Crashing")
    for controller, code, kind in (("missing", 3, "Failure"), ("crashing", 4, "Error")):
        done = realbench(place, "score", "--controller", controller, *test, *cases, code=code)
        assert "Traceback" not in done.stderr
        suites = JUnitXml.fromfile(str(place / "j.xml"))
        found = [type(each).__name__ for suite in suites for case in suite for each in case.result]
        assert found == [kind]
    realbench(place, "score", "--controller", "no_such_folder", *test, code=1)
    realbench(place, "score", "--controller", "crashing", "--trials", "x", code=2)


def test_empty_folder_and_packed_archive_are_refused(place: Path) -> None:
    (place / "empty").mkdir()
    with pytest.raises(ControllerError, match="has no submission"):
        ControllerSource.of(str(place / "empty"))
    (place / "some.zip").touch()
    with pytest.raises(ControllerError, match="is packed: unpack it"):
        ControllerSource.of(str(place / "some.zip"))


@pytest.mark.parametrize("name", ["/abs.py", "../up.py", "a/../../up.py", "back\\slash.py"])
def test_archive_that_leads_out_of_its_folder_is_refused(tmp_path: Path, name: str) -> None:
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        archive.writestr("submission.yaml", "name: x")
        archive.writestr(name, "x")
    with pytest.raises(SubmissionError, match="leads out of its folder"):
        unpack(tmp_path / "a.zip", tmp_path / "out")


def test_links_and_bombs_in_archives_are_refused(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "link.zip", "w") as archive:
        archive.writestr("submission.yaml", "name: x")
        link = zipfile.ZipInfo("secret.py")
        link.external_attr = (stat.S_IFLNK | 0o777) << 16
        archive.writestr(link, "/etc/passwd")
    with pytest.raises(SubmissionError, match="has a link"):
        unpack(tmp_path / "link.zip", tmp_path / "out")
    with zipfile.ZipFile(tmp_path / "many.zip", "w") as archive:
        archive.writestr("submission.yaml", "name: x")
        for number in range(10_001):
            archive.writestr(f"{number}", "")
    with pytest.raises(SubmissionError, match="too large: 10,002 files"):
        unpack(tmp_path / "many.zip", tmp_path / "out")


def test_submission_packed_with_its_folder_is_found(tmp_path: Path) -> None:
    """As operating systems compress a folder."""
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        archive.writestr("mine/submission.yaml", json.dumps({"name": "x", "authors": "y"}))
        archive.writestr("mine/controller.py", GOOD)
        archive.writestr("__MACOSX/mine/._controller.py", "x")
    unpack(tmp_path / "a.zip", tmp_path / "out")
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        "submission.yaml",
        "controller.py",
    }
    with pytest.raises(SubmissionError, match="entry: "):
        read_submission(tmp_path / "out")
