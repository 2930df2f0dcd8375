from __future__ import annotations

import hashlib
import itertools
import os
import re
import resource
import shutil
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from real_bench.conditions import Condition
from real_bench.errors import RecordingError
from real_bench.phases.intrinsic import IntrinsicPhase
from real_bench.recording import Header, Recording, recorder
from real_bench.recording.schema import Batch
from real_bench.recording.writer import AppendOnlyFile
from real_bench.simulation import Scene
from tests.outside.bench import after_first_line
from tests.recording.bench import SCENE, ignore, realbench, recorded_steps, run, start, wait_for

N_ACTIONS = 7  # in the recording that was cut
ROWS = ("transitions", "commands", "states", "images", "cuts", "ground_truth/object_poses")
HEAVY = f"{Path(__file__).parents[1] / 'phases' / 'controllers' / 'series.py'}:Heavy"
PLAY = ("intrinsic", "--controller", "real_r", "--scene", SCENE, "--out", "run.h5", "--resume")
ENDLESS_STEPS = 15_000_000
ENDLESS = realbench(*PLAY, "--steps", ENDLESS_STEPS, eager=True)


def begun(path: Path, header: Header, scene: Scene) -> AppendOnlyFile:
    """An empty recording."""
    file = AppendOnlyFile(path)
    file.create(header, 4, scene.manifest.camera)
    return file


def batch_of(path: Path, first: int, last: int, state: dict[str, Any] | None = None) -> Batch:
    """The rows of some actions of a recording, as they came to the writer."""
    with Recording(path) as recording, h5py.File(path) as file:
        rows = recording.transitions
        states = slice(
            rows["outcome"][first - 1] + 1 if first else 0, rows["outcome"][last - 1] + 1
        )
        begin = rows["first_command"][first]
        commands = slice(begin, begin + rows["n_commands"][first:last].sum())
        return Batch(
            transitions=rows[first:last],
            commands=file["commands"][commands],
            states=file["states"][states],
            images=file["images"][states],
            object_poses=file["ground_truth/object_poses"][states],
            cuts=file["cuts"][()] if last == len(rows) else file["cuts"][:0],
            n_steps=int(rows["n_steps"][:last].sum()),
            total_steps=recording.total_steps,
            ended=last == len(rows),
            controller_state={"n_actions": last} if state is None else state,
            commands_sha256=None,
        )


def content_hash(file: BinaryIO) -> str:
    file.seek(0)
    return hashlib.sha256(file.read()).hexdigest()


def same_rows(one: Path, other: Path) -> bool:
    with h5py.File(one) as first, h5py.File(other) as second:
        return all(first[name][()].tobytes() == second[name][()].tobytes() for name in ROWS)


@settings(max_examples=15, deadline=None)
@given(st.lists(st.integers(1, N_ACTIONS - 1), unique=True).map(sorted), st.data())
def test_rows_do_not_depend_on_their_batches(
    cut_path: Path,
    scene: Scene,
    header: Header,
    tmp_path_factory: pytest.TempPathFactory,
    bounds: list[int],
    data: st.DataObject,
) -> None:
    path = tmp_path_factory.mktemp("batches") / "run.h5"
    file = begun(path, header, scene)
    for first, last in zip([0, *bounds], [*bounds, N_ACTIONS], strict=True):
        if first and data.draw(st.booleans(), label="another process goes on"):
            file.close()
            file = AppendOnlyFile(path)
        file.append(batch_of(cut_path, first, last))
        with Recording(path) as recording:
            assert len(recording.transitions) == last
            assert recording.controller_state() == {"n_actions": last}
    file.close()
    assert same_rows(path, cut_path)
    assert list(path.parent.iterdir()) == [path]


@pytest.mark.parametrize("links", [True, False])
@pytest.mark.parametrize("killed", [True, False])
def test_overwritten_file_returns_if_no_action_is_recorded(
    cut_path: Path,
    scene: Scene,
    header: Header,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    killed: bool,
    links: bool,
) -> None:
    if not links:
        monkeypatch.setattr(os, "link", refuse)
    path = tmp_path / "run.h5"
    path.write_bytes(cut_path.read_bytes())
    file = begun(path, header, scene)
    with Recording(path) as recording:
        assert len(recording.transitions) == 0
    if killed:  # what a process that dies does not do
        file._is_empty = False
        file._before.replace(tmp_path / "kept")
        file.close()
        (tmp_path / "kept").replace(file._before)
        file = AppendOnlyFile(path)
    file.close()
    assert path.read_bytes() == cut_path.read_bytes()
    assert list(tmp_path.iterdir()) == [path]

    file = begun(path, header, scene)
    file.append(batch_of(cut_path, 0, 1))
    file.close()
    assert list(tmp_path.iterdir()) == [path]
    with Recording(path) as recording:
        assert len(recording.transitions) == 1


def refuse(*names: object) -> None:
    raise OSError("no links here")


def test_a_recording_without_an_action_leaves_nothing(
    scene: Scene, header: Header, tmp_path: Path
) -> None:
    file = begun(tmp_path / "run.h5", header, scene)
    file.close()
    assert list(tmp_path.iterdir()) == []


def test_rewritten_state_does_not_grow_the_file(
    cut_path: Path, scene: Scene, header: Header, tmp_path: Path
) -> None:
    file, weights = AppendOnlyFile(tmp_path / "run.h5"), np.random.default_rng(0).bytes(300_000)
    file.create(header, 4, scene.manifest.camera)
    for k in range(N_ACTIONS):
        file.append(batch_of(cut_path, k, k + 1, {"weights": weights}))
    file.close()
    assert file.path.stat().st_size < 3 * len(weights)


def test_many_writes_take_little_more_space_than_one(
    cut_path: Path, scene: Scene, header: Header, tmp_path: Path
) -> None:
    sizes = []
    for name, n_writes in (("once", 1), ("often", N_ACTIONS)):
        file = begun(tmp_path / name, header, scene)
        bounds = np.linspace(0, N_ACTIONS, n_writes + 1).astype(int).tolist()
        for first, last in itertools.pairwise(bounds):
            file.append(batch_of(cut_path, first, last))
        file.close()
        sizes.append(file.path.stat().st_size)
    assert sizes[1] < 1.5 * sizes[0]


class CtrlC(dict[str, Any]):
    """A state during whose writing Ctrl-C is pressed."""

    def items(self) -> Any:
        signal.raise_signal(signal.SIGINT)
        return super().items()


@pytest.fixture
def ctrl_c_interrupts() -> Iterator[None]:
    """Also where the tests run in the background, whose Ctrl-C the shell ignores."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("ctrl_c_interrupts")
def test_interrupted_write_can_be_repeated(
    cut_path: Path, scene: Scene, header: Header, tmp_path: Path
) -> None:
    file = begun(tmp_path / "run.h5", header, scene)
    file.append(batch_of(cut_path, 0, 2))
    with pytest.raises(KeyboardInterrupt):
        file.append(batch_of(cut_path, 2, N_ACTIONS, CtrlC()))
    file.append(batch_of(cut_path, 2, N_ACTIONS))
    file.close()
    assert same_rows(file.path, cut_path)


@pytest.mark.parametrize("is_overwritten", [True, False])
def test_write_that_is_interrupted_when_it_is_done_stays(
    cut_path: Path,
    scene: Scene,
    header: Header,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    is_overwritten: bool,
) -> None:
    path = tmp_path / "run.h5"
    if is_overwritten:
        path.write_bytes(cut_path.read_bytes())
    file = begun(path, header, scene)
    swap = file._swap

    def swap_and_interrupt() -> bool:
        swap()
        monkeypatch.undo()
        raise KeyboardInterrupt

    monkeypatch.setattr(file, "_swap", swap_and_interrupt)
    batch = batch_of(cut_path, 0, 2)
    with pytest.raises(KeyboardInterrupt):
        file.append(batch)
    for _ in range(2):
        file.append(batch)
    file.close()
    assert list(tmp_path.iterdir()) == [path]
    with Recording(path) as recording:
        assert len(recording) == 2


def test_what_is_no_recording_can_be_overwritten_after_a_kill(
    cut_path: Path, scene: Scene, header: Header, tmp_path: Path
) -> None:
    path = tmp_path / "run.h5"
    path.write_text("notes")
    path.with_name(".run.h5.before").hardlink_to(path)  # killed before it was replaced
    file = begun(path, header, scene)
    file.close()
    assert path.read_text() == "notes"
    assert list(tmp_path.iterdir()) == [path]


def test_unclear_leftovers_are_kept_and_reported(tmp_path: Path) -> None:
    path, before = tmp_path / "run.h5", tmp_path / ".run.h5.before"
    path.write_text("notes")
    before.write_text("other notes")
    for _ in range(2):  # and the file is not locked afterwards
        with pytest.raises(RecordingError, match="move one of them away"):
            AppendOnlyFile(path)
    assert (path.read_text(), before.read_text()) == ("notes", "other notes")


def stop(writer: subprocess.Popen[str]) -> None:
    writer.terminate()
    _, message = writer.communicate()
    assert writer.returncode == 130, message


def test_a_reader_always_finds_a_whole_file(tmp_path: Path) -> None:
    """While another process writes, every reading extends the one before."""
    out = tmp_path / "run.h5"
    writer = start(ENDLESS, tmp_path)
    wait_for(writer, out.exists)
    lengths: set[int] = set()
    known: list[Any] = []
    while len(lengths) < 10:
        assert writer.poll() is None, writer.communicate()
        with Recording(out) as recording:
            rows = recording.transitions
            n_states = len(rows) + 1 if len(rows) else 0
            assert len(recording.images()) == recording.n_states == n_states
        assert rows[: len(known)].tolist() == known
        known = rows.tolist()
        lengths.add(len(rows))
    stop(writer)
    assert recorded_steps(out) >= 1000 * len(known)


def test_neither_readers_nor_second_writers_disturb_a_writer(tmp_path: Path, scene: Scene) -> None:
    out = tmp_path / "run.h5"
    writer = start(ENDLESS, tmp_path)
    wait_for(writer, lambda: recorded_steps(out) >= 1000)
    choices: list[dict[str, Any]] = [{"resume": True}, {"overwrite": True}]
    second = IntrinsicPhase("real_r", Condition.parse("IM"), 1, scene, ENDLESS_STEPS, 0, out)
    with Recording(out) as held, out.open("rb") as raw:
        content, n_steps = content_hash(raw), held.n_steps
        for choice in choices:
            with pytest.raises(RecordingError, match="being written by another process"):
                second.run(ignore, **choice)
        wait_for(writer, lambda: recorded_steps(out) > n_steps + 3000)
        assert content_hash(raw) == content
        assert len(held.states) == held.n_states
    stop(writer)


def test_file_being_copied_does_not_change(
    cut_path: Path, scene: Scene, header: Header, tmp_path: Path
) -> None:
    """A reader without HDF5's lock: cp, rsync, a hash."""
    file = begun(tmp_path / "run.h5", header, scene)
    file.append(batch_of(cut_path, 0, 1))
    with file.path.open("rb") as raw:
        content = content_hash(raw)
        for k in range(1, N_ACTIONS):
            file.append(batch_of(cut_path, k, k + 1))
        assert content_hash(raw) == content


def test_reader_in_the_same_process_does_not_disturb_the_writer(
    cut_path: Path, scene: Scene, header: Header, tmp_path: Path
) -> None:
    file = begun(tmp_path / "run.h5", header, scene)
    file.append(batch_of(cut_path, 0, 1))
    with Recording(file.path):
        for k in range(1, N_ACTIONS):
            file.append(batch_of(cut_path, k, k + 1))
    assert same_rows(file.path, cut_path)


def test_file_removed_before_there_is_a_copy_is_reported(
    cut_path: Path, scene: Scene, header: Header, tmp_path: Path
) -> None:
    file = begun(tmp_path / "run.h5", header, scene)
    file.path.unlink()
    with pytest.raises(RecordingError, match="was removed during the recording"):
        file.append(batch_of(cut_path, 0, 1))


def test_file_removed_while_it_is_copied_is_restored(
    cut_path: Path,
    scene: Scene,
    header: Header,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    file = begun(tmp_path / "run.h5", header, scene)
    copy, removed = shutil.copyfileobj, []

    def remove_and_copy(*arguments: Any) -> None:
        file.path.unlink()
        removed.append(file.path)
        copy(*arguments)

    with monkeypatch.context() as patch:
        patch.setattr(shutil, "copyfileobj", remove_and_copy)
        file.append(batch_of(cut_path, 0, 1))
    assert removed
    for k in range(1, N_ACTIONS):
        file.append(batch_of(cut_path, k, k + 1))
    assert same_rows(file.path, cut_path)


def test_file_removed_later_is_restored(
    cut_path: Path, scene: Scene, header: Header, tmp_path: Path
) -> None:
    file = begun(tmp_path / "run.h5", header, scene)
    file.append(batch_of(cut_path, 0, 1))
    for k in range(1, N_ACTIONS):
        if k == N_ACTIONS // 2:
            file.path.unlink()
        file.append(batch_of(cut_path, k, k + 1))
    assert same_rows(file.path, cut_path)


@pytest.mark.parametrize(
    ("controller", "most_bytes"),
    [("real_r", 30_000), (HEAVY, 200_000)],
)
def test_failed_write_gives_a_one_line_error(
    tmp_path: Path, controller: str, most_bytes: int
) -> None:
    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (most_bytes, most_bytes))

    command = realbench(*PLAY, "--controller", controller, "--steps", 12_000, eager=True)
    writer = start(command, tmp_path, limit)
    _, message = writer.communicate()
    assert writer.returncode == 1
    fault = after_first_line(message)
    told = re.fullmatch(r"realbench: error: cannot write .*run\.h5: [\w ]+; (.*)\n", fault)
    assert told
    if (tmp_path / "run.h5").exists():
        assert "use --resume" in told[1]
        assert 0 < recorded_steps(tmp_path / "run.h5") < 12_000
    else:
        assert told[1] == "nothing was recorded"


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    mount = ["mount", "-t", "tmpfs", "-o", "size=48k", "none", str(tmp_path)]
    if subprocess.run(mount, capture_output=True).returncode:
        pytest.skip("only root may mount a small disk")
    yield tmp_path
    subprocess.run(["umount", tmp_path], check=True)


def test_a_full_disk_loses_nothing_that_was_recorded(small_disk: Path, image_path: Path) -> None:
    stopped = run(realbench(*PLAY, "--steps", 12_000, eager=True), small_disk)
    assert stopped.returncode != 0
    assert re.search(r"cannot write .*run\.h5: No space left", stopped.stderr)
    subprocess.run(["mount", "-o", "remount,size=10m", small_disk], check=True)
    out = small_disk / "run.h5"
    assert recorded_steps(out) < 12_000
    resumed = run(realbench(*PLAY, "--steps", 12_000), small_disk)
    assert resumed.returncode == 0, resumed.stderr
    with Recording(out) as recording, Recording(image_path) as uninterrupted:
        assert recording.n_steps == 12_000
        assert (recording.commands() == uninterrupted.commands(0, 12)).all()


@pytest.mark.parametrize("removed", [False, True])
def test_hard_link_to_a_recording_keeps_its_content(
    cut_path: Path, scene: Scene, header: Header, tmp_path: Path, removed: bool
) -> None:
    """A backup by ``ln``, made at any moment."""
    file = begun(tmp_path / "run.h5", header, scene)
    backups = []
    for k in range(N_ACTIONS):
        file.append(batch_of(cut_path, k, k + 1))
        backup = tmp_path / f"backup-{k}.h5"
        os.link(file.path, backup)
        backups.append((backup, backup.read_bytes()))
        if removed and k == N_ACTIONS // 2:
            file.path.unlink()
    file.close()
    assert all(backup.read_bytes() == content for backup, content in backups)
    assert same_rows(file.path, cut_path)
    assert not list(tmp_path.glob(".*"))


def test_hard_linked_backup_does_not_change_on_resume(
    scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recorder, "SECONDS_BETWEEN_WRITES", 0.0)
    run, backup = tmp_path / "run.h5", tmp_path / "backup.h5"
    condition = Condition.parse("OM")
    IntrinsicPhase("real_r", condition, 1, scene, 1000, 0, run).run(ignore)
    os.link(run, backup)
    before = backup.read_bytes()
    IntrinsicPhase("real_r", condition, 1, scene, 4000, 0, run).run(ignore, resume=True)
    assert backup.read_bytes() == before
    assert recorded_steps(run) == 4000
