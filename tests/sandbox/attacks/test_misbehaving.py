"""Whatever a controller does, its run ends in time, with an error that says what it did."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import real_bench.scoring.metric
from real_bench.conditions import Condition
from real_bench.errors import ControllerError, ControllerStoppedError
from real_bench.goal_sets import GoalSet, save_goal_set
from real_bench.phases.local import LocalBackend
from real_bench.phases.player import Player, make_player
from real_bench.phases.proxy import ControllerProxy
from real_bench.sandbox import SandboxBackend, SandboxSupport, kernel_support, process
from real_bench.scoring.result import load_result
from real_bench.simulation import Scene
from real_bench.task import Task
from tests.cli.shell import realbench
from tests.phases.conftest import toy
from tests.recording.bench import realbench as command_line
from tests.recording.bench import recorded_steps, start, wait_for, wait_until
from tests.sandbox.conftest import LIMITS, Face, Play

pytestmark = pytest.mark.attacks

HERE = Path(__file__).parent
ROGUE = f"{HERE / 'rogue.py'}:Rogue"
IMPATIENT_S = 0.5  # for those that hang: it does not matter when this is over

ENDS = {
    "segfault": "killed by SIGSEGV .*in next_action",
    "abort": "killed by SIGABRT .*in next_action",
    "exit_at_once": "ended with exit code 3 in next_action",
    "kill_itself": "killed by SIGKILL in next_action",
    "close_the_channel": "closed the channel",
}
TAKES = {
    "take_memory": "MemoryError",
    "take_memory_at_once": "MemoryError|Unable to allocate",
    "fork_on_and_on": "Operation not permitted",
    "start_threads_on_and_on": "can't start new thread",
}
HANGS = ("hang", "hang_in_a_loop", "ask_on_and_on", "announce_and_fall_silent")
LIES = {
    "say_garbage": "refused: it declares",
    "announce_much": "refused: it declares",
    "speak_out_of_turn": "refused: it answered a question that was not asked",
    "answer_twice": "bad action: an action was expected",
    "blame_with_control_letters": r"RuntimeError: .\[2J red and more",
}
OBJECTS = {
    "a_hostile_array": "an action was expected, not Hostile",
    "a_liar_about_its_class": "an action was expected, not Liar",
    "an_action_of_its_own_kind": "an action was expected, not OwnAction",
    "broken_numbers": "must be finite numbers",
    "a_negative_duration": "must last 1 to",
    "an_overflowing_duration": "must last 1 to",
    "a_huge_shape": "durations",
    "objects_in_an_action": "bad action|failed at",
}


@pytest.fixture(autouse=True)
def survivors(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Nothing that was started is left when a test is over."""
    started: list[subprocess.Popen[bytes]] = []
    start = process._start

    def noted(*arguments: Any) -> subprocess.Popen[bytes]:
        child = start(*arguments)
        started.append(child)
        return child

    monkeypatch.setattr(process, "_start", noted)
    yield
    for child in started:
        assert child.poll() is not None
        wait_until(lambda child=child: child.pid not in sessions())  # type: ignore[misc]


def sessions() -> set[int]:
    """The sessions of all processes; those of a sandbox are seen from here, too."""
    found = set()
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            found.add(int(path.read_text().rpartition(")")[2].split()[3]))
        except OSError:
            continue
    return found


@pytest.fixture
def task(scene: Scene) -> Iterator[Task]:
    task = Task(scene, Condition.parse("OM"))
    task.begin()
    yield task
    task.close()


def told(task: Task, support: SandboxSupport, deed: str, controller: str = ROGUE) -> str:
    """What is said of a controller that does its deed at its second action."""
    limits = replace(LIMITS, memory_gib=2)
    proxy = SandboxBackend((), limits, support).proxy(controller, {"deed": deed}, task)
    try:
        player = make_player(proxy, task)
        player.play(1)
        if deed in HANGS:
            proxy.client.limits = replace(limits, call_s=IMPATIENT_S)
        with pytest.raises(ControllerError) as caught:
            play_on(proxy, player)
    finally:
        proxy.close()
    text = str(caught.value)
    assert text.isprintable()
    assert len(text) < 3000
    assert controller in text
    return text


def play_on(proxy: ControllerProxy, player: Player) -> None:
    """The action at which it goes wrong, and what follows from that."""
    player.play(20)
    proxy.get_state()


@pytest.mark.parametrize("deed", ENDS)
def test_it_dies(
    task: Task, isolated: SandboxBackend, deed: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    if deed == "close_the_channel":  # and lives on
        monkeypatch.setattr(process, "TIMEOUT_S", IMPATIENT_S)
    assert re.search(ENDS[deed], told(task, isolated.support, deed))


def test_it_stops_itself(task: Task, support: SandboxSupport) -> None:
    """Which may as well have been somebody else."""
    proxy = SandboxBackend((), LIMITS, support).proxy(ROGUE, {"deed": "stop_itself"}, task)
    player = make_player(proxy, task)
    player.play(1)
    with pytest.raises(ControllerStoppedError, match="killed by SIGTERM in next_action"):
        player.play(20)


@pytest.mark.parametrize("deed", TAKES)
def test_it_takes_too_much(task: Task, deed: str) -> None:
    """Without bubblewrap, which has no part in this."""
    if "fork" in deed and not kernel_support().seccomp:
        pytest.skip("system calls cannot be filtered here")
    assert re.search(TAKES[deed], told(task, kernel_support(), deed))


@pytest.mark.parametrize("deed", HANGS)
def test_it_hangs(task: Task, isolated: SandboxBackend, deed: str) -> None:
    message = told(task, isolated.support, deed)
    assert f"next_action() did not end within the {IMPATIENT_S} s of --call-limit" in message


@pytest.mark.parametrize("deed", LIES)
def test_it_lies(task: Task, isolated: SandboxBackend, deed: str) -> None:
    assert re.search(LIES[deed], told(task, isolated.support, deed))


@pytest.mark.parametrize("deed", OBJECTS)
def test_an_action_is_a_hostile_object(task: Task, deed: str) -> None:
    """Already where it is made, which alone knows whole objects, and so can say what is wrong."""
    assert re.search(OBJECTS[deed], told_here(task, ROGUE, deed))


@pytest.mark.parametrize("deed", ["array", "render", "mapping", "numbers"])
def test_a_step_is_a_hostile_object(task: Task, deed: str) -> None:
    assert "returned a bad action" in told_here(task, f"{HERE / 'rogue.py'}:StepRogue", deed)


def told_here(task: Task, controller: str, deed: str) -> str:
    proxy = LocalBackend().proxy(controller, {"deed": deed}, task)
    player = make_player(proxy, task)
    player.play(1)
    with pytest.raises(ControllerError) as caught:
        player.play(20)
    return str(caught.value)


def test_number_of_a_strange_type_becomes_a_plain_number(
    task: Task, isolated: SandboxBackend
) -> None:
    proxy = isolated.proxy(ROGUE, {"deed": "strange_numbers"}, task)
    player = make_player(proxy, task)
    player.play(1)
    durations = player.play(20).n_steps
    proxy.close()
    assert durations.tolist() == [20]  # what it claims is cut to what is left
    assert durations.dtype == np.int64


@pytest.mark.parametrize("deed", ["objects", "dict", "keys", "deep"])
def test_a_state_is_a_hostile_object(play: Play, isolated: SandboxBackend, deed: str) -> None:
    controller = f"{HERE / 'rogue.py'}:StateRogue"
    with pytest.raises(ControllerError, match=r"state|gotcha|RecursionError"):
        play(controller, 1000, backend=isolated, settings={"deed": deed})


def test_output_floods(
    play: Play, isolated: SandboxBackend, capfd: pytest.CaptureFixture[str]
) -> None:
    run = play(ROGUE, 3000, backend=isolated, settings={"deed": "print_on_and_on"})
    assert recorded_steps(run) == 3000
    shown = capfd.readouterr().err
    assert "?[2J?]0;title?first words" in shown
    assert "the rest is not shown" in shown
    assert "last words" not in shown
    assert len(shown) < 2 * process.OUTPUT_BYTES


def test_it_hangs_at_exit(play: Play, isolated: SandboxBackend) -> None:
    run = play(ROGUE, 3000, backend=isolated, settings={"deed": "hang_at_exit"})
    assert recorded_steps(run) == 3000


def test_actions_before_a_crash_are_kept(
    play: Play, isolated: SandboxBackend, tmp_path: Path
) -> None:
    with pytest.raises(ControllerError, match="SIGSEGV"):
        play(ROGUE, 3000, backend=isolated, settings={"deed": "segfault"})
    assert recorded_steps(tmp_path / "run.h5") == 1000


def test_trials_before_a_crash_are_kept(
    face_goals: Face, isolated: SandboxBackend, tmp_path: Path
) -> None:
    with pytest.raises(ControllerError, match="exit code 7 in seed"):
        face_goals(toy("tested:DiesInTheSecondTrial"), backend=isolated)
    assert [trial.goal for trial in load_result(tmp_path / "score.json").trials] == [0]


def test_the_benchmark_is_killed(tmp_path: Path) -> None:
    """Nothing of the controller survives it, though nobody is left to end it."""
    command = ["intrinsic", "--controller", ROGUE, "--set", "deed=hang", "--isolate"]
    more = ["--condition", "OM", "--scene", "builtin", "--steps", "9000"]
    benchmark = start(command_line(*command, *more), tmp_path)
    wait_for(benchmark, lambda: "start.py" in str([arguments(one) for one in below(benchmark.pid)]))
    family = below(benchmark.pid)
    benchmark.kill()
    benchmark.communicate()
    wait_until(lambda: not any("start.py" in arguments(one) for one in family))


def below(pid: int) -> list[int]:
    """The processes that a process started, and theirs."""
    parents = {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            parents[int(path.parent.name)] = int(path.read_text().rpartition(")")[2].split()[1])
    found = [one for one, parent in parents.items() if parent == pid]
    return found + [deeper for one in found for deeper in below(one)]


def arguments(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/cmdline").read_text()
    except OSError:
        return ""


def test_our_modules_are_patched(face_goals: Face, isolated: SandboxBackend) -> None:
    """It plays as one that does not patch, and scores as much."""
    here = face_goals(ROGUE, out="honest", settings={"deed": "nothing"})
    scores = real_bench.scoring.metric.object_scores
    there = face_goals(f"{HERE / 'rogue.py'}:Patches", backend=isolated, out="patched")
    assert here.trials == there.trials
    assert real_bench.scoring.metric.object_scores is scores


@pytest.mark.parametrize(
    ("content", "fault"),
    [
        ("import time\ntime.sleep(1e6)", "its import did not end within the 5 s of --call-limit"),
        ("raise KeyError('no')", "cannot be loaded: .*line 1: KeyError"),
        ("import sys\nsys.exit(0)", "cannot be loaded: .*SystemExit"),
        ("raise KeyboardInterrupt", "ended with exit code|killed by SIGINT"),
        ("import os\nos._exit(0)", "its process ended with exit code 0 in its import"),
        ("def f(:", "cannot be loaded: .*line 1"),
        ("x = '\0'", "cannot be loaded"),
    ],
    ids=["hangs", "raises", "exits", "interrupts", "is gone", "is no Python", "holds a zero"],
)
def test_its_import(tmp_path: Path, goals: GoalSet, content: str, fault: str) -> None:
    """From the command line: one line, not a traceback of ours; nothing is written."""
    (tmp_path / "submission").mkdir()
    (tmp_path / "submission" / "mine.py").write_text(content)
    save_goal_set(goals, tmp_path / "goals.npy")
    limit = "5" if "sleep" in content else "60"
    done = realbench(
        tmp_path,
        *("extrinsic", "--controller", "submission/mine.py", "--goals", "goals.npy", "--isolate"),
        *("--scene", "builtin", "--call-limit", limit, "--trials", "1"),
        code=3 if "cannot be loaded" in fault else 4,
    )
    last = done.stderr.splitlines()[-1]
    assert last.startswith("realbench: error: controller ")
    assert "submission/mine.py" in last
    assert re.search(fault, last)
    assert not (tmp_path / "score.json").exists()


def test_an_entry_point_raises(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """In our own process, too: whatever it raises is an error of ours."""
    from importlib.metadata import EntryPoint

    from real_bench.controller_code import finding, source

    (tmp_path / "entry_that_exits.py").write_text("raise SystemExit(0)")
    monkeypatch.syspath_prepend(tmp_path)
    offer = EntryPoint("bad", "entry_that_exits:Class", source.GROUP)
    monkeypatch.setattr(source, "_offers", lambda: {"bad": offer})
    with pytest.raises(ControllerError, match=r"bad cannot be loaded: .*SystemExit"):
        finding.find_controller("bad")
    assert "entry_that_exits" not in sys.modules
