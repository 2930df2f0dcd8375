"""What a controller can get at: everything in our own process, nothing in isolation."""

from __future__ import annotations

import json
import os
import re
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import real_bench
from real_bench.errors import ControllerError
from real_bench.goal_sets import GoalSet, save_goal_set
from real_bench.sandbox import SandboxBackend, SandboxSupport
from real_bench.sandbox.support import _visible_paths
from real_bench.sandbox.visible_files import VisibleFiles
from real_bench.scoring.result_file import FORMAT as RESULT
from tests.sandbox.attacks.spy import ATTACKS
from tests.sandbox.conftest import LIMITS, Face, Play

pytestmark = pytest.mark.attacks

SPY = str(Path(__file__).with_name("spy.py")) + ":Spy"
TOKEN = ("kept-by-another-", f"process-{os.getpid()}")
Loot = dict[str, str]

RUN_HERE = """
import sys
from real_bench.cli import main
main(sys.argv[1:])
"""


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory, goals: GoalSet) -> Path:
    folder = tmp_path_factory.mktemp("secrets")
    save_goal_set(goals, folder / "goals.npy")
    (folder / "score.json").write_text(json.dumps({"format": RESULT}))
    return folder


@pytest.fixture(scope="module")
def listener() -> Iterator[int]:
    """A port that somebody listens on, and an abstract socket."""
    with socket.socket() as network, socket.socket(socket.AF_UNIX) as local:
        network.bind(("127.0.0.1", 0))
        local.bind("\0" + "".join(TOKEN))
        for end in (network, local):
            end.listen(100)
        yield network.getsockname()[1]


@pytest.fixture
def settings(place: Path, listener: int) -> dict[str, Any]:
    return {
        "goals": str(place / "goals.npy"),
        "result": str(place / "score.json"),
        "run": str(place / "run.h5"),
        "package": str(Path(real_bench.__file__).parent),
        "port": listener,
        "token": list(TOKEN),
    }


@pytest.fixture
def run(place: Path, play: Play) -> Path:
    """A recording with images, and with the true poses that were never to be seen."""
    path = place / "run.h5"
    if not path.exists():
        play("real_r", 1000, condition="IM", out=str(path))
    return path


def loot(told: str) -> Loot:
    found = re.search(r"loot (\{.*\})", told)
    assert found, told
    content: Loot = json.loads(found[1])
    return content


_FOUND: dict[SandboxSupport, Loot] = {}  # one spy tries everything; the tests look at what it got


@pytest.fixture
def isolated_loot(
    support: SandboxSupport,
    settings: dict[str, Any],
    run: Path,
    face_goals: Face,
    monkeypatch: pytest.MonkeyPatch,
) -> Loot:
    if support not in _FOUND:
        monkeypatch.setenv("TOKEN", "".join(TOKEN))
        secrets = tuple(Path(settings[name]) for name in ("goals", "result", "run"))
        with pytest.raises(ControllerError) as caught:
            face_goals(
                SPY,
                backend=SandboxBackend(secrets, LIMITS, support),
                condition="IM",
                run=run,
                settings=settings,
            )
        _FOUND[support] = loot(str(caught.value))
    return _FOUND[support]


@pytest.mark.parametrize("name", ATTACKS)
def test_a_spy_gets(isolated_loot: Loot, name: str) -> None:
    """... nothing."""
    assert isolated_loot.get(name, "") == ""


@pytest.mark.skipif(sys.platform != "linux", reason="the attacks are on Linux")
def test_without_isolation_the_spy_gets_it(
    settings: dict[str, Any], run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """So that the attacks are real ones. In a process of its own: some leave traces."""
    options = [f"--set={name}={json.dumps(value)}" for name, value in settings.items()]
    place = run.parent
    command = [
        *(sys.executable, "-c", RUN_HERE, "extrinsic", "--controller", SPY, *options),
        *("--run", str(run), "--goals", settings["goals"], "--out", settings["result"]),
        *("--condition", "IM", "--scene", "builtin", "--overwrite"),
    ]
    monkeypatch.setenv("TOKEN", "".join(TOKEN))
    monkeypatch.setenv("TMPDIR", str(place))
    done = subprocess.run(command, cwd=place, capture_output=True, text=True, check=False)
    got = loot(done.stderr)
    (place / "other.json").unlink()
    (place / "mine").unlink()
    (place / "large").unlink()
    assert {"read_the_goals", "write_the_result", "network", "forking"} <= got.keys()
    assert {"goals_in_frames", "goals_in_the_garbage_collector", "the_simulation"} <= got.keys()
    missing = ATTACKS.keys() - got.keys()
    assert missing <= NEEDS_MORE


NEEDS_MORE = {
    # What a condition hides is hidden in our process, too.
    "positions_in_the_observation",
    # Which processes and limits may be touched depends on who runs the tests.
    "higher_limits",
    "memory_of_other_processes",
    "tracing_other_processes",
    "reading_memory_by_system_call",
    "signals_to_other_processes",
    "limits_of_other_processes",
    "settings_of_the_system",
    "files_outside_of_its_own_folder",
    "new_namespaces",
    "change_our_code",
    "change_installed_packages",
}


PEEPS = """
import json
import pathlib
from real_bench.controller import Controller

class Peeps(Controller):
    def start_extrinsic_phase(self):
        got = {}
        for path in PATHS:
            try:
                if text := pathlib.Path(path).read_text():
                    got[path] = text
            except OSError:
                pass
        raise ValueError("loot " + json.dumps(got))

    def next_action(self, observation):
        raise NotImplementedError
"""


def test_links_and_what_is_not_hashed_are_out_of_reach(
    support: SandboxSupport, tmp_path: Path, face_goals: Face
) -> None:
    """A link below a folder in which something is hidden; code and data that no hash covers."""
    (private := tmp_path / "private").mkdir()
    (private / "file").write_text("secret")
    package = tmp_path / "mine" / "package"
    (package / "__pycache__").mkdir(parents=True)
    (package / "link").symlink_to(private)
    (package / "score.json").write_text(json.dumps({"format": RESULT}))
    (package / "hashed.txt").write_text("hashed")
    (package / ".weights").write_text("not hashed")
    (package / "__pycache__" / "helper.pyc").write_text("not hashed")
    names = ("link/file", "score.json", "hashed.txt", ".weights", "__pycache__/helper.pyc")
    paths = [*(str(package / name) for name in names), str(private / "file")]
    code = tmp_path / "mine" / "peeps.py"
    code.write_text(f"PATHS = {paths!r}\n{PEEPS}")
    with pytest.raises(ControllerError) as caught:
        face_goals(str(code), backend=SandboxBackend((), LIMITS, support))
    assert loot(str(caught.value)) == {str(package / "hashed.txt"): "hashed"}


def test_a_link_does_not_show_what_is_hidden_in_the_folder_it_leads_to(tmp_path: Path) -> None:
    """As lib64 leads to lib in a virtual environment."""
    (tmp_path / "lib" / "goals").mkdir(parents=True)
    (tmp_path / "lib" / "package").mkdir()
    (tmp_path / "lib64").symlink_to("lib")
    shared = (tmp_path, tmp_path / "lib64", tmp_path / "lib64" / "goals")
    visible = VisibleFiles((), shared, (tmp_path / "lib" / "goals",))
    assert list(_visible_paths(visible)) == [tmp_path / "lib" / "package"] * 2
