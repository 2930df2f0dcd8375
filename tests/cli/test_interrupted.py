"""Ctrl-C at any moment ends a command with code 130, and says what can be continued."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from tests.cli.shell import COMMAND, heed_ctrl_c
from tests.recording.bench import PATIENCE_S

PRESSES = """
import os, signal
from real_bench import Action, Controller

class Presses(Controller):
    number = 0

    def get_state(self):
        return {"number": self.number}

    def set_state(self, state):
        self.number = state["number"]

    def next_action(self, observation):
        self.number += 1
        if self.number == LAST:
            os.kill(os.getpid(), signal.SIGINT)
        return Action.rest(4, 20)
"""


def pressed(folder: Path, at_action: int, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Of a command whose controller presses Ctrl-C in this action."""
    (folder / "presses.py").write_text(PRESSES.replace("LAST", str(at_action)))
    return subprocess.run(
        [str(COMMAND), *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        preexec_fn=heed_ctrl_c,
    )


@pytest.mark.parametrize(
    ("at_action", "told"),
    [
        (1, "interrupted"),  # the first action, alone
        (2, "stopped"),  # play
        (3, "stopped"),  # its end
        (4, "stopped"),  # the only trial
    ],
)
def test_a_check_ends_wherever_it_is(tmp_path: Path, at_action: int, told: str) -> None:
    done = pressed(tmp_path, at_action, "check", "presses.py", "--condition", "OM")
    assert (done.returncode, done.stdout) == (130, "")
    assert done.stderr.splitlines()[-1] == f"realbench: {told}"


def test_evaluate_says_how_to_go_on(tmp_path: Path) -> None:
    play = ["--condition", "OM", "--scene", "builtin", "--controller", "presses.py"]
    done = pressed(tmp_path, 3, "evaluate", *play, "--steps", "200")
    assert done.returncode == 130
    assert done.stderr.splitlines()[-1] == (
        "realbench: stopped at step 60 of 200; everything up to here is recorded in run.h5; the "
        "controller was in memory: if it has get_state() or use_experience(), go on with "
        "`realbench intrinsic --out run.h5 --resume`"
    )
    done = pressed(tmp_path, 0, "intrinsic", "--out", "run.h5", "--resume")
    assert done.returncode == 0, done.stderr


def test_a_test_without_a_trial_names_no_file(tmp_path: Path) -> None:
    play = ["--condition", "OM", "--scene", "builtin", "--controller", "presses.py"]
    done = pressed(tmp_path, 1, "extrinsic", *play, "--trial-steps", "1000", "--as-made")
    assert done.returncode == 130
    last = done.stderr.splitlines()[-1]
    assert last.startswith("realbench: stopped before the first trial ended") or "1 of 50" in last


def test_a_wish_that_comes_as_the_work_ends_is_heeded(tmp_path: Path) -> None:
    play = ["--condition", "OM", "--scene", "builtin", "--controller", "presses.py"]
    done = pressed(tmp_path, 10, "intrinsic", *play, "--steps", "200")
    assert done.returncode == 130
    assert done.stderr.splitlines()[-1] == "realbench: stopped at the end of the work"
