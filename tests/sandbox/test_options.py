"""The options of isolation, and what an isolated controller sees of the file system."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest

from real_bench.controller_code.finding import find_controller
from real_bench.controller_code.source import ControllerSource
from real_bench.errors import ControllerError, RealBenchError
from real_bench.goal_sets import GoalSet, save_goal_set
from real_bench.sandbox import Limits, SandboxBackend, SandboxSupport
from real_bench.sandbox.visible_files import visible_files
from tests.cli.shell import realbench
from tests.recording.bench import recorded_steps
from tests.sandbox.conftest import LIMITS, Play

RESULTS = Path(__file__).parents[2] / "evaluation" / "results"


def test_commands_report_what_isolates_the_controller(tmp_path: Path, goals: GoalSet) -> None:
    """Both phases in isolation; beside the controller lie the goals, and a name of other bytes."""
    save_goal_set(goals, tmp_path / "goals.npy")
    (tmp_path / os.fsdecode(b"caf\xe9.py")).touch()
    (tmp_path / "mine.py").write_text(
        "import tempfile\n"
        "from real_bench.actions import Action\n"
        "from real_bench.controller import Controller\n"
        "class Mine(Controller):\n"
        "    def next_action(self, observation):\n"
        "        tempfile.NamedTemporaryFile('w').write('x')\n"
        "        return Action.rest(4)\n"
    )
    options = ["--controller", "mine.py", "--scene", "builtin", "--isolate"]
    limits = ["--memory-limit", "4", "--call-limit", "60", "--total-limit", "100"]
    play = ["--condition", "OM", "--steps", "1000", "--out", "run.h5"]
    done = realbench(tmp_path, "intrinsic", *options, *limits, *play)
    isolated, controller, *_ = done.stderr.splitlines()
    assert isolated.startswith("the controller is isolated by ")
    assert controller == f"controller: class Mine of {tmp_path / 'mine.py'}"
    test = ["--goals", "goals.npy", "--trials", "1", "--trial-steps", "1000"]
    done = realbench(tmp_path, "extrinsic", *options, *test, "--run", "run.h5", "--as-made")
    assert "isolated" in done.stderr
    evaluate = ["--condition", "OM", "--steps", "1000", "--run", "run.h5", "--overwrite"]
    realbench(tmp_path, "evaluate", *options, *test, *evaluate)


@pytest.mark.parametrize("option", ["--memory-limit", "--call-limit", "--total-limit"])
def test_limits_need_isolation(tmp_path: Path, option: str) -> None:
    done = realbench(tmp_path, "intrinsic", "--controller", "real_r", option, "1", code=2)
    assert "--isolate" in done.stderr


@pytest.mark.parametrize("field", ["memory_gib", "call_s", "total_s"])
@pytest.mark.parametrize("value", [0, -1, float("nan"), float("inf")])
def test_limits_must_be_positive(field: str, value: float) -> None:
    with pytest.raises(RealBenchError, match="-limit must be above 0"):
        Limits(**{field: value})


def test_missing_enforcement_is_reported() -> None:
    assert SandboxSupport("/usr/bin/bwrap", True, True).missing() == []
    nothing = SandboxSupport(None, False, False)
    assert len(nothing.missing()) >= 4
    assert "NOT enforced: files" in nothing.describe()


def test_controller_plays_without_any_sandbox_support(play: Play) -> None:
    backend = SandboxBackend((), LIMITS, SandboxSupport(None, False, False))
    assert recorded_steps(play("real_r", 1000, backend=backend)) == 1000


def test_controller_sees_its_folder_without_our_files_and_links(
    tmp_path: Path, play: Play, goals: GoalSet, shared: Path
) -> None:
    """Its own weights may be HDF5, NumPy or JSON as well: what counts is what is in a file."""
    folder = tmp_path / "submission"
    (folder / "data").mkdir(parents=True)
    for name in ("mine.py", "helper.py", "options.yml"):
        (folder / name).touch()
    with h5py.File(folder / "weights.h5", "w") as file:
        file["weights"] = np.arange(3)
    np.save(folder / "weights.npy", np.arange(3))
    np.savez(folder / "data" / "weights.npz", weights=np.arange(3))
    (folder / "notes.json").write_text("{}")
    save_goal_set(goals, folder / "goals.npy")
    shutil.copy(play("real_r"), folder / "data" / "run.hdf5")
    shutil.copy(RESULTS / "real_r-OM-1.json", folder / "old.txt")
    shutil.copy(shared / "goals" / "official-2-objects.npz", folder / "goals.npz")
    (folder / "link.py").symlink_to(folder / "goals.npy")
    visible = visible_files(ControllerSource.of(str(folder / "mine.py")))
    assert sorted(path.name for path in visible.own) == [
        *("data", "helper.py", "mine.py", "notes.json"),
        *("options.yml", "weights.h5", "weights.npy"),
    ]
    assert visible.hidden_names() == ["data/run.hdf5", "goals.npy", "goals.npz", "old.txt"]
    visible.check_hides([folder / "goals.npy", folder / "data" / "run.hdf5", tmp_path / "run.h5"])
    with pytest.raises(ControllerError, match=r"more.npy lies where an isolated controller may"):
        visible.check_hides([folder / "data" / "more.npy"])


def test_shipped_goals_are_hidden() -> None:
    visible = visible_files(ControllerSource.of("real_r"))
    assert [path.name for path in visible.hidden] == ["goals"]
    visible.check_hides([visible.hidden[0] / "goals-1-object.npy"])


@pytest.mark.parametrize("spec", ["missing.py", "no_such_module:Class", "no_such_name"])
def test_missing_controller_is_refused(spec: str) -> None:
    with pytest.raises(ControllerError, match=r"not found|no module|unknown controller"):
        visible_files(ControllerSource.of(spec))


@pytest.mark.parametrize("spec", ["real_d", "tests.sandbox.controllers:Looks"])
def test_identity_is_the_same_in_isolation(isolated: SandboxBackend, spec: str) -> None:
    one = isolated.identity(spec, {})
    kind = find_controller(spec)
    assert one.class_name == kind.__qualname__
    assert one.code_sha256 == ControllerSource.of(spec).code_sha256 != ""
    assert one.settings.keys() == ({"abstraction", "planner", "images"} if "_d" in spec else set())


def test_controller_cannot_claim_the_code_of_another(
    tmp_path: Path, isolated: SandboxBackend
) -> None:
    (tmp_path / "mine.py").write_text(
        "from real_bench.controllers.real_r import RealR\n"
        "class Mine(RealR):\n"
        "    pass\n"
        "import inspect\n"
        "from real_bench.controllers import real_r\n"
        "inspect.getfile = lambda kind: real_r.__file__\n"
    )
    spec = str(tmp_path / "mine.py")
    hashes = {isolated.identity(spec, {}).code_sha256, ControllerSource.of(spec).code_sha256}
    assert len(hashes) == 1
    assert ControllerSource.of("real_r").code_sha256 not in hashes


def test_the_total_limit_counts_all_calls(isolated: SandboxBackend) -> None:
    backend = SandboxBackend((), Limits(LIMITS.memory_gib, LIMITS.call_s, 0.01), isolated.support)
    with pytest.raises(ControllerError, match=r"did not end within the 0.01 s of --total-limit"):
        backend.identity("real_r", {})
