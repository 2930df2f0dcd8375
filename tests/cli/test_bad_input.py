"""Whatever is wrong is told in one clear line, with a non-zero exit, and nothing is lost."""

from __future__ import annotations

from pathlib import Path

import h5py
import pytest

from real_bench.goal_sets import save_goal_set, shipped_goal_set
from real_bench.simulation import Scene
from tests.cli.shell import realbench, tiny_goals, write_controller
from tests.outside.bench import after_first_line

PLAY = ("intrinsic", "--scene", "builtin", "--condition", "OM")
BAD = [
    ("--controller", controller)
    for controller in (
        *(
            "broken.py",
            "raising.py",
            "quit.py",
            "empty.py",
            "two.py",
            "two.py:C",
            "learner.py:Lerner",
        ),
        *("no.such.module:C", "math:pi"),
    )
]
EVALUATE = ("evaluate", "--scene", "builtin", "--condition", "OM", "--controller", "real_r")
TEST = ("extrinsic", "--scene", "builtin", "--condition", "OM", "--controller", "real_r")


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory, builtin_scene: Scene) -> Path:
    folder = tmp_path_factory.mktemp("place")
    save_goal_set(tiny_goals(builtin_scene), folder / "goals.npy")
    save_goal_set(tiny_goals(builtin_scene, n_objects=2), folder / "two.npy")
    realbench(folder, *PLAY, "--controller", "real_r", "--steps", "1000")
    recording = (folder / "run.h5").read_bytes()
    (folder / "cut.h5").write_bytes(recording[: len(recording) // 2])
    (folder / "text.h5").write_text("not a recording")
    (folder / "newer.h5").write_bytes(recording)
    with h5py.File(folder / "newer.h5", "r+") as file:
        file.attrs["schema_version"] = 99
    (folder / "broken.py").write_text("class A:\n    def step(self, o, r, d)\n        pass\n")
    (folder / "raising.py").write_text("import os\nraise ValueError('no such luck')\n")
    (folder / "empty.py").write_text("x = 1\n")
    (folder / "two.py").write_text(
        "from real_robots.policy import BasePolicy as P\n"
        "class A(P):\n    def step(self): 0\nclass B(A): pass\n"
    )
    (folder / "learner.py").write_text("class Learner: pass\n")
    (folder / "quit.py").write_text("import sys\nsys.exit(0)\n")
    return folder


def refusal(folder: Path, *arguments: str, code: int = 1) -> str:
    """The one line that a command says; the folder must be as it was."""
    before = {path: path.read_bytes() for path in folder.iterdir() if path.is_file()}
    done = realbench(folder, *arguments, code=code)
    assert {path: path.read_bytes() for path in folder.iterdir() if path.is_file()} == before
    lines = [line for line in after_first_line(done.stderr).splitlines() if line.strip()]
    assert "Traceback" not in done.stderr
    assert done.stdout == ""
    assert len(lines) == 1, done.stderr
    return lines[0]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ("--controller", "real_x"),
            "unknown controller 'real_x': use one of real_d, real_g, real_gj, real_ild, real_ld, "
            "real_r, real_t",
        ),
        (("--controller", "none.py"), "controller file not found: none.py"),
        (("--controller", "broken.py"), "broken.py, line 2: expected ':'"),
        (("--controller", "raising.py"), "raising.py, line 2: ValueError: no such luck"),
        (("--controller", "quit.py"), "quit.py, line 2: SystemExit"),
        (("--controller", "empty.py"), "found none"),
        (("--controller", "two.py"), "found A, B; name it as two.py:Class"),
        (("--controller", "two.py:C"), "class not found: C"),
        (("--controller", "learner.py:Lerner"), "not found: Lerner, did you mean Learner?"),
        (("--controller", "raising"), "or a submission's folder, did you mean raising.py?"),
        (("--controller", "no.such.module:C"), "No module named 'no'"),
        (("--controller", "math:pi"), "is not a class"),
        (("--controller", "real_r", "--condition", "XY"), "unknown condition 'XY': use one of OM"),
        (("--controller", "reald"), "a submission's folder, did you mean real_d?"),
        (
            ("--controller", "real_d", "--set", "planner.deph=8"),
            "planner.deph: unknown name, did you mean planner.depth? (settings and defaults:",
        ),
        (("--controller", "real_d", "--set", "depth=8"), "did you mean planner.depth?"),
        (("--controller", "real_d", "--set", "planer.depth=8"), "did you mean planner?"),
        (("--controller", "real_r", "--scene", "oficial"), "did you mean official?"),
        (("--controller", "real_r", "--scene", "moon"), "unknown scene 'moon': use builtin or"),
        (("--controller", "real_r", "--objects", "4"), "from 1 to 3, not 4"),
        (("--controller", "real_r", "--objects", "0"), "from 1 to 3, not 0"),
        (
            ("--controller", "real_r", "--steps", "0"),
            "from 1 to 2**63 - 1, not 0",
        ),
        (
            ("--controller", "real_r", "--steps", "-5"),
            "from 1 to 2**63 - 1, not -5",
        ),
        (
            ("--controller", "real_r", "--seed", "-1"),
            "from 0 to 2**63 - 1, not -1",
        ),
        (
            ("--controller", "real_r", "--condition", "IM", "--no-images"),
            "needs images: leave out --no-images",
        ),
        (("--controller", "real_r", "--out", "no/such/run.h5"), "cannot write into no/such"),
        (("--controller", "real_r", "--out", "/proc/run.h5"), "cannot write into /proc"),
        (("--controller", "real_r", "--out", "."), "is a folder"),
        (("--resume", "--out", "cut.h5"), "cut.h5 cannot be read"),
        (("--resume", "--out", "text.h5"), "text.h5 cannot be read"),
        (("--resume", "--out", "newer.h5"), "schema version 99"),
        (("--resume", "--seed", "3"), "cannot be resumed"),
        (("--resume", "--steps", "10"), "already holds 1,000 steps, 10 were asked for"),
    ],
)
def test_intrinsic_refuses_bad_input(place: Path, arguments: tuple[str, ...], message: str) -> None:
    out = () if {"--out", "--resume"} & set(arguments) else ("--out", "new.h5")
    assert message in refusal(place, *PLAY, *arguments, *out, code=3 if arguments in BAD else 1)


def test_existing_recording_is_not_overwritten(place: Path) -> None:
    refused = refusal(place, *PLAY, "--controller", "real_r")
    assert "run.h5 exists: use --resume or --overwrite" in refused


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ("--run", "run.h5", "--goals", "two.npy"),
            "the goals are for 2 objects (cube, tomato), the run has 1",
        ),
        (("--goals", "none.npy"), "none.npy"),
        (("--goals", "run.h5"), "run.h5"),
        (("--run", "none.h5"), "recording not found: none.h5"),
        (("--run", "text.h5"), "text.h5 cannot be read"),
        (("--run", "run.h5", "--objects", "2"), "run.h5 does not fit this test"),
        (("--goals", "goals.npy", "--run-steps", "0"), "run steps must be a whole number from 1"),
        (
            ("--goals", "goals.npy", "--run-steps", "1001"),
            "run.h5 has 1,000 steps, 1,001 were asked for",
        ),
        (
            ("--goals", "goals.npy", "--trials", "0"),
            "whole number from 1 to 2, not 0",
        ),
        (
            ("--goals", "goals.npy", "--trials", "3"),
            "whole number from 1 to 2, not 3",
        ),
        (
            ("--goals", "goals.npy", "--jobs", "0"),
            "jobs must be a whole number of at least 1",
        ),
        (("--goals", "goals.npy", "--out", "/proc/score.json"), "cannot write into /proc"),
        (("--goals", "goals.npy", "--out", "two.npy"), "two.npy is no result, so it is not"),
        (("--goals", "goals.npy", "--out", "two.npy", "--resume"), "two.npy is no result, so"),
        (("--goals", "goals.npy", "--controller", "raising.py"), "no such luck"),
    ],
)
def test_extrinsic_refuses_bad_input(place: Path, arguments: tuple[str, ...], message: str) -> None:
    assert message in refusal(place, *TEST, *arguments, code=3 if BAD[1][1] in arguments else 1)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ((*TEST, "--run", "run.h5", "--out", "run.h5"), "--out run.h5 is also --run"),
        ((*TEST, "--out", "run.h5"), "--out run.h5 is also --run"),  # by default
        ((*TEST, "--goals", "goals.npy", "--out", "./goals.npy"), "is also --goals"),
        ((*PLAY, "--controller", "empty.py:A", "--out", "empty.py"), "is also --controller"),
        (("report", "run.h5", "--out", "run.h5"), "--out run.h5 is also an input"),
        ((*EVALUATE, "--run", "goals.npy", "--goals", "goals.npy"), "--run goals.npy is also"),
        ((*EVALUATE, "--run", "new.h5", "--out", "new.h5"), "new.h5 is also"),
        (("score", "goals.npy", "--junit", "n.xml", "--markdown", "n.xml"), "n.xml is also"),
        (("score", "goals.npy", "--markdown", "goals.npy"), "goals.npy is also an input"),
        (("score", "go*.npy", "--junit", "goals.npy"), "goals.npy is also an input"),
        (("score", "go", "--baseline", "go*", "--junit", "goals.npy"), "is also --baseline"),
        (("film", "run.h5", "--out", "run.h5"), "--out run.h5 is also an input"),
    ],
)
def test_no_command_writes_over_what_it_reads(
    place: Path, arguments: tuple[str, ...], told: str
) -> None:
    assert told in refusal(place, *arguments, "--overwrite", code=2)


def test_a_recording_that_nobody_named_is_not_replaced(place: Path) -> None:
    refused = refusal(place, *EVALUATE, "--goals", "goals.npy", "--overwrite", code=2)
    assert "run.h5 exists, and --overwrite replaces it only if it is named: add --run" in refused


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("intrinsic", "mine.py"), ", did you mean --controller mine.py?"),
        (("extrinsic", "run.h5", "goals.npy"), ", did you mean --run run.h5?"),
        (("extrinsic", "goals.npy"), ", did you mean --goals goals.npy?"),
        (("intrinsic", "run.h5"), "(run.h5) (see"),
        (("intrinsic", "fast"), "(fast) (see"),
    ],
)
def test_a_file_without_its_option_gets_it(
    place: Path, arguments: tuple[str, ...], told: str
) -> None:
    assert told in refusal(place, *arguments, code=2)


def test_goals_of_another_scene_are_refused(place: Path, official_scene: Scene) -> None:
    shipped = refusal(place, *TEST, "--goals", str(shipped_goal_set(1)))
    assert "the goals were made in scene official" in shipped


@pytest.mark.parametrize("file", ["cut.h5", "text.h5", "none.h5", "none.json", "none.npy"])
def test_inspect_refuses_missing_and_unreadable_files(place: Path, file: str) -> None:
    assert file in refusal(place, "inspect", file)


def test_missing_controller_is_reported(tmp_path: Path) -> None:
    done = realbench(tmp_path, "intrinsic", code=1)
    assert "no controller given (try --controller real_r)" in done.stderr


@pytest.mark.parametrize(
    ("name", "body", "message"),
    [
        ("nothing", "return None", "not NoneType"),
        ("nan", "return {'macro_action': [float('nan')] * 4}", "finite numbers"),
        ("shape", "return {'macro_action': [0, 0]}", "4 numbers, not an array of shape (2,)"),
        ("key", "return {'joint_command': [0] * 9}", "it has: nothing"),
        ("raises", "raise RuntimeError('tired')", "raises.py, line 7: RuntimeError: tired"),
        ("quits", "raise SystemExit(0)", "SystemExit"),
    ],
)
def test_failing_controller_keeps_what_was_recorded(
    tmp_path: Path, name: str, body: str, message: str
) -> None:
    text = (
        "from real_robots.policy import BasePolicy\n"
        "class C(BasePolicy):\n    def __init__(self, a, o): self.n = 0\n"
        "    def step(self, o, r, d):\n"
        "        self.n += 1\n        if self.n > 1500:\n"
        f"            {body}\n        return {{'macro_action': None}}\n"
    )
    (tmp_path / f"{name}.py").write_text(text)
    arguments = (*PLAY, "--controller", f"{name}.py", "--steps", "5000")
    done = realbench(tmp_path, *arguments, code=4)
    controller, forgets, *others, fault = done.stderr.splitlines()
    assert controller.startswith("controller: class C of ")
    assert "it has neither get_state() nor use_experience()" in forgets
    *warning, kept = others
    assert len(warning) == (name == "key")  # as in the official package
    assert kept.startswith("1,000 steps are recorded in run.h5: once what fails is mended, ")
    assert f"controller {name}.py" in fault
    assert message in done.stderr
    inspected = realbench(tmp_path, "inspect", "run.h5", "--json").stdout
    assert '"steps": 1000' in inspected
    assert not list(tmp_path.glob(".*"))


def test_controller_failing_at_once_leaves_recordings_untouched(tmp_path: Path) -> None:
    write_controller(tmp_path / "typo.py", "def next_action(self, observation): return self.randm")
    play = ["--condition", "OM", "--scene", "builtin", "--steps", "2000"]
    assert (
        "randm" in realbench(tmp_path, "intrinsic", "--controller", "typo.py", *play, code=4).stderr
    )
    assert not (tmp_path / "run.h5").exists()
    realbench(tmp_path, "intrinsic", "--controller", "real_r", *play)
    kept = (tmp_path / "run.h5").read_bytes()
    realbench(tmp_path, "intrinsic", "--controller", "typo.py", *play, "--overwrite", code=4)
    assert (tmp_path / "run.h5").read_bytes() == kept
