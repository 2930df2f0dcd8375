"""A controller that tries to get at what it must not have, and tells what it got.

It is told where everything lies: nothing must depend on its not knowing that.
"""

from __future__ import annotations

import ctypes
import gc
import importlib.util
import json
import os
import resource
import signal
import socket
import stat
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from real_bench.actions import Action
from real_bench.controller import Controller, Experience
from real_bench.settings import Settings


class SpySettings(Settings):
    """Where everything lies.

    Attributes:
        goals, result, run, package: files and folders to read or write.
        port: on which somebody listens on this machine.
        token: what another process holds in its environment and memory; in two halves, so that it
            is not in ours.
    """

    goals: str
    result: str
    run: str
    package: str
    port: int
    token: tuple[str, str]


Attack = Callable[["Spy"], object]
ATTACKS: dict[str, Attack] = {}


def attack(function: Attack) -> Attack:
    """Register an attack; it gives what it got, or nothing."""
    ATTACKS[function.__name__] = function
    return function


class Spy(Controller):
    """Tries every attack before its first action, and raises what came of them."""

    Settings = SpySettings
    told: tuple[str, Any] = ("", None)

    def __init__(self, action_space: Any, observation_space: Any, settings: SpySettings) -> None:
        super().__init__(action_space, observation_space)
        self.settings = settings
        self.experience: Experience | None = None
        self.observation: Any = None

    def use_experience(self, experience: Experience) -> None:
        self.experience = experience

    def next_action(self, observation: Any) -> Action:
        self.observation = observation
        loot = {name: self.tried(function) for name, function in ATTACKS.items()}
        raise RuntimeError("loot " + json.dumps({k: v[:60] for k, v in loot.items() if v}))

    def tried(self, function: Attack) -> str:
        try:
            got = function(self)
        except Exception:  # refused, in whatever way
            return ""
        return str(got) if got else ""


def read(path: str | Path) -> str:
    with Path(path).open("rb") as file:
        return f"{len(file.read(100))} bytes of {path}"


@attack
def read_the_goals(spy: Spy) -> object:
    return read(spy.settings.goals)


@attack
def read_the_result(spy: Spy) -> object:
    return read(spy.settings.result)


@attack
def read_the_recording(spy: Spy) -> object:
    return read(spy.settings.run)


@attack
def read_the_shipped_goals(spy: Spy) -> object:
    found = importlib.util.find_spec("real_bench.goals")
    assert found is not None
    assert found.submodule_search_locations is not None
    folder = Path(next(iter(found.submodule_search_locations)))
    return [read(path) for path in folder.glob("*.npy")]


@attack
def find_goals_anywhere(spy: Spy) -> object:
    for folder, _, files in os.walk("/"):
        if folder.startswith(("/proc", "/sys")):
            continue
        for name in files:
            if "goal" in name and name.endswith((".npy", ".npz")):
                with suppress(OSError):
                    return read(Path(folder, name))
    return ""


@attack
def write_the_result(spy: Spy) -> object:
    return os.open(spy.settings.result, os.O_WRONLY)


@attack
def write_the_goals(spy: Spy) -> object:
    return os.open(spy.settings.goals, os.O_WRONLY)


@attack
def replace_the_result(spy: Spy) -> object:
    other = Path(spy.settings.result).with_name("other.json")
    other.write_text("{}")
    return other


@attack
def change_our_code(spy: Spy) -> object:
    return os.open(Path(spy.settings.package, "scoring", "metric.py"), os.O_WRONLY)


@attack
def change_installed_packages(spy: Spy) -> object:
    return os.open(np.__file__, os.O_WRONLY)


@attack
def write_into_the_inbox(spy: Spy) -> object:
    assert spy.experience is not None
    path = Path(spy.experience.path).with_name("mine")
    path.write_text("")
    return path


@attack
def positions_in_the_experience(spy: Spy) -> object:
    import h5py

    assert spy.experience is not None
    with h5py.File(spy.experience.path) as file:
        truth, state = "ground_truth" in file, len(file["controller_state"])
        assert len(file["images"])
        return "ground_truth" * truth + "state" * bool(state)


@attack
def positions_in_the_observation(spy: Spy) -> object:
    return [key for key in spy.observation if "pos" in key and key != "joint_positions"]


@attack
def goals_in_frames(spy: Spy) -> object:
    frame: Any = sys._getframe()
    found = []
    while frame is not None:
        found += [name for name, value in frame.f_locals.items() if is_benchmark_file(value)]
        frame = frame.f_back
    return found


@attack
def goals_in_the_garbage_collector(spy: Spy) -> object:
    return [type(one).__name__ for one in gc.get_objects() if is_benchmark_file(one)]


def is_benchmark_file(value: Any) -> bool:
    return type(value).__name__ in ("Goal", "GoalSet", "Simulation", "Task", "TrialMaker")


@attack
def the_simulation(spy: Spy) -> object:
    import pybullet

    return [client for client in range(20) if pybullet.getConnectionInfo(client)["isConnected"]]


@attack
def open_descriptors(spy: Spy) -> object:
    found, sockets = [], 0
    for number in range(256):
        try:
            kind = os.fstat(number).st_mode
        except OSError:
            continue
        sockets += stat.S_ISSOCK(kind)
        if number > 2 and not stat.S_ISSOCK(kind):
            found.append(number)
    return found or (sockets if sockets > 1 else "")


@attack
def environment_and_arguments(spy: Spy) -> object:
    token = "".join(spy.settings.token)
    texts = [str(dict(os.environ)), str(sys.argv), str(sys.orig_argv)]
    for path in [*Path("/proc").glob("*/cmdline"), *Path("/proc").glob("*/environ")]:
        try:
            texts.append(path.read_text(errors="replace"))
        except OSError:
            continue
    return [text for text in texts if token in text or spy.settings.goals in text]


def other_processes() -> list[int]:
    seen = [int(path.name) for path in Path("/proc").glob("[0-9]*")]
    return [pid for pid in {os.getppid(), 1, *seen} if pid not in (0, os.getpid())]


@attack
def memory_of_other_processes(spy: Spy) -> object:
    token = "".join(spy.settings.token).encode()
    for pid in other_processes():
        try:
            lines = Path(f"/proc/{pid}/maps").read_text().splitlines()
            with Path(f"/proc/{pid}/mem").open("rb", 0) as memory:
                for line in lines:
                    if "rw-p" in line:
                        start, end = (int(part, 16) for part in line.split()[0].split("-"))
                        memory.seek(start)
                        if token in memory.read(end - start):
                            return f"the token, in {pid}"
        except (OSError, ValueError):
            continue
    return ""


@attack
def tracing_other_processes(spy: Spy) -> object:
    seize = 0x4206  # does not stop it
    libc = ctypes.CDLL(None)
    return [pid for pid in other_processes() if libc.ptrace(seize, pid, None, None) == 0]


@attack
def reading_memory_by_system_call(spy: Spy) -> object:
    libc = ctypes.CDLL(None, use_errno=True)
    libc.process_vm_readv(os.getppid(), None, 0, None, 0, 0)
    return ctypes.get_errno() == 0 and "allowed"


@attack
def signals_to_other_processes(spy: Spy) -> object:
    allowed = []
    for pid in other_processes():
        try:
            os.kill(pid, 0)
        except OSError:
            continue
        allowed.append(pid)
    return allowed


@attack
def limits_of_other_processes(spy: Spy) -> object:
    return resource.prlimit(os.getppid(), resource.RLIMIT_NOFILE)


@attack
def higher_limits(spy: Spy) -> object:
    before = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    return resource.getrlimit(resource.RLIMIT_AS) != before


@attack
def network(spy: Spy) -> object:
    with socket.create_connection(("127.0.0.1", spy.settings.port), timeout=5):
        return "connected"


@attack
def abstract_sockets(spy: Spy) -> object:
    with socket.socket(socket.AF_UNIX) as end:
        end.connect("\0" + "".join(spy.settings.token))
        return "connected"


@attack
def forking(spy: Spy) -> object:
    child = os.fork()
    if child == 0:
        os._exit(0)
    return os.waitpid(child, 0)


@attack
def starting_programs(spy: Spy) -> object:
    return subprocess.run([sys.executable, "-c", "print('ran')"], capture_output=True).stdout


@attack
def files_outside_of_its_own_folder(spy: Spy) -> object:
    """Without a name, so that none is left behind where it succeeds."""
    found = []
    for folder in ("/", "/etc", "/usr", "/root", "/home", "/dev", "/dev/shm", "/var", "/sys"):
        with suppress(OSError):
            os.close(os.open(folder, os.O_TMPFILE | os.O_WRONLY))
            found.append(folder)
    return found


@attack
def settings_of_the_system(spy: Spy) -> object:
    """Nothing is written, but it could be."""
    return os.open("/proc/sys/kernel/core_pattern", os.O_WRONLY)


@attack
def new_namespaces(spy: Spy) -> object:
    return ctypes.CDLL(None).unshare(0x10000000) == 0 and "a user namespace"


@attack
def memory_beside_the_limit(spy: Spy) -> object:
    return os.memfd_create("hidden")


@attack
def a_larger_file_than_allowed(spy: Spy) -> object:
    with Path(os.environ["TMPDIR"], "large").open("wb") as file:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        file.seek(2**31)
        written = file.write(b"x")
        file.flush()
        return written
