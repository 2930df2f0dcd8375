"""A recording as a Minari dataset, the Farama Foundation's format for offline data.

Each uninterrupted stretch of play is an episode, each action a step of it. Observations are those
of ``RealBench/REAL-OM-Action-v0`` and its siblings, with images if they were recorded, and no more
than the condition lets a controller see.
"""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any
from uuid import uuid4

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from real_bench.action_environment import flat_action_space, flat_observation_space
from real_bench.actions import ACTION_STEPS
from real_bench.conditions import Condition
from real_bench.errors import RecordingError
from real_bench.extras import extra
from real_bench.files.atomic import OutputError, real_path
from real_bench.files.outputs import check_folder
from real_bench.recording import Recording
from real_bench.recording.arrays import resize_images
from real_bench.replay import fresh_states
from real_bench.simulation.scene import load_scene
from real_bench.spaces import action_space, observation_space
from real_bench.text.counting import counted
from real_bench.version import __version__

if TYPE_CHECKING:
    from real_bench.exporting.formats import Export, OnExport

MIN_VERSION = "0.5.4"
"""The first version that keeps images exactly as they are; earlier ones pack them as JPEG."""

ACTIONS_AT_ONCE = 128
"""Actions whose images are held in memory."""

_NAME = re.compile(r"([A-Za-z0-9_-]+/)*[A-Za-z0-9_-]+-v\d+")

Arrays = dict[str, NDArray[Any]]


def save_minari(export: Export, report: OnExport) -> str:
    """Write the dataset into the folder as Minari expects it; returns how to load it.

    Raises:
        MissingExtraError: Minari is not installed.
        OutputError: it exists, or cannot be written.
        RecordingError: its name is invalid.
    """
    name = export.name or f"realbench/{_plain(export.recording.path.stem)}-v0"
    if not _NAME.fullmatch(name):
        raise RecordingError(f"a dataset's name must look like realbench/run-v0, not {name!r}")
    storages = extra("minari.dataset.minari_storage", "minari", MIN_VERSION)
    episodes = _Episodes(export.recording, export.images, export.image_size)
    with _replacement(export.folder.absolute() / name, overwrite=export.overwrite) as hidden:
        storage = storages.MinariStorage.new(
            hidden / "data",
            observation_space=episodes.observation_space,
            action_space=episodes.action_space,
            jpeg_encoding=False,  # the images exactly as they are
        )
        storage.update_metadata(_metadata(name, export.recording))
        for number, length in enumerate(episodes.write(storage, report)):
            storage.update_episode_metadata([{"total_steps": length}], [number])
    return f"MINARI_DATASETS_PATH={export.folder}, minari.load_dataset({name!r})"


class _Episodes:
    """The play as Minari has it: stretches, observations and actions."""

    def __init__(
        self, recording: Recording, images: bool, image_size: tuple[int, int] | None
    ) -> None:
        header = recording.header
        self._recording, self._image_size = recording, image_size
        self._condition = Condition.parse(header.condition)
        self._has_images = images and recording.n_images is not None
        if image_size is not None and not self._has_images:
            raise RecordingError(f"{recording.path} has no images to shrink")
        self._table, self._states = recording.to_numpy(), recording.states
        self._poses = recording.object_poses if self._condition.sees_objects else None
        scene = load_scene(header.scene_source)
        flat = flat_observation_space(
            observation_space(scene, self._condition, header.objects), goals=False
        )
        self.observation_space = spaces.Dict(
            {key: box for key, box in flat.items() if key != "retina"} | self._image_box()
        )
        self._is_plain = self._only_whole_macros()
        self.action_space: spaces.Space[Any] = (
            flat_action_space(action_space(scene, self._condition))
            if self._is_plain
            else self._padded_space()
        )

    def write(self, storage: Any, report: OnExport) -> Iterator[int]:
        """Write one episode after the other, some actions at a time; yields their lengths."""
        buffers = extra("minari.data_collector", "minari")
        rows = self._recording.transitions
        begins = np.isin(rows["precondition"], fresh_states(self._recording))
        firsts = np.flatnonzero(begins).tolist()
        for number, (first, end) in enumerate(zip(firsts, [*firsts[1:], len(rows)], strict=True)):
            for start in range(first, end, ACTIONS_AT_ONCE):
                stop = min(start + ACTIONS_AT_ONCE, end)
                storage.update_episodes(
                    [buffers.EpisodeBuffer(id=number, **self._steps(start, stop, first, end))]
                )
                report(stop, len(rows))
            yield end - first

    def _steps(self, start: int, stop: int, first: int, end: int) -> dict[str, Any]:
        rows = self._recording.transitions
        state = int(rows["precondition"][start]) + (start > first)  # the first is there already
        last = int(rows["outcome"][stop - 1])
        truncated = np.zeros(stop - start, bool)
        truncated[-1] = stop == end
        return {
            "observations": self._observations(state, last - state + 1),
            "actions": self._actions(start, stop),
            "rewards": np.zeros(stop - start),
            "terminations": np.zeros(stop - start, bool),
            "truncations": truncated,
            "infos": {"step": self._states["step"][state : last + 1]},
        }

    def _observations(self, first: int, count: int) -> Arrays:
        states = self._states[first : first + count]
        columns: Arrays = {key: states[key] for key in ("joint_positions", "touch_sensors")}
        if self._poses is not None:
            poses = self._poses[first : first + count]
            columns["object_positions"] = poses[:, :, :3].reshape(count, -1)
            columns["object_orientations"] = poses[:, :, 3:].reshape(count, -1)
        if self._has_images:
            columns["retina"] = resize_images(
                self._recording.images(first, count), self._image_size
            )
        return {key: columns[key] for key in self.observation_space}

    def _actions(self, start: int, stop: int) -> NDArray[Any] | Arrays:
        if self._is_plain:
            plain: NDArray[Any] = self._table["commands"][start:stop, 0]
            return plain
        commands, n_steps = (self._table[key][start:stop] for key in ("commands", "n_steps"))
        is_rest = np.isnan(commands).any(axis=2)
        return {
            "commands": np.where(is_rest[:, :, None], 0.0, commands),
            "n_steps": n_steps,
            "line": self._table["line"][start:stop].astype(np.int8),
            "rest": is_rest.astype(np.int8),
        }

    def _only_whole_macros(self) -> bool:
        commands, n_steps = self._table["commands"], self._table["n_steps"]
        whole = commands.shape[1:] == (1, 4) and (n_steps == ACTION_STEPS).all()
        return self._condition.control == "M" and bool(whole and np.isfinite(commands).all())

    def _padded_space(self) -> spaces.Dict:
        most, size = self._table["commands"].shape[1:]
        return spaces.Dict(
            {
                "commands": spaces.Box(-np.inf, np.inf, (most, size), np.float64),
                "n_steps": spaces.Box(0, 2**62, (most,), np.int64),
                "line": spaces.MultiBinary(most),
                "rest": spaces.MultiBinary(most),
            }
        )

    def _image_box(self) -> dict[str, spaces.Space[Any]]:
        if not self._has_images:
            return {}
        height, width, _ = self._recording.image_shape
        if self._image_size is not None:
            width, height = self._image_size
        return {"retina": spaces.Box(0, 255, (height, width, 3), np.uint8)}


def _metadata(name: str, recording: Recording) -> dict[str, Any]:
    header = recording.header
    return {
        "dataset_id": name,
        "minari_version": extra("minari", "minari").__version__,
        "algorithm_name": header.controller_class,
        "description": (
            f"Free play in the REAL benchmark: {header.controller_class}, {header.condition}, "
            f"{counted(header.objects, 'object')}, scene {header.scene} "
            f"({header.scene_sha256[:12]}), seed {header.seed}; one action per step, no reward."
        ),
        "requirements": [f"real-bench=={__version__}"],
    }


@contextmanager
def _replacement(place: Path, *, overwrite: bool) -> Iterator[Path]:
    """A hidden folder that replaces a dataset once it is written; after a failure, none does."""
    place = real_path(place)
    _check_replaceable(place, overwrite=overwrite)
    check_folder(place.parent, make=True)
    hidden, former = (place.with_name(f".{uuid4().hex[:12]}") for _ in range(2))
    try:
        hidden.mkdir()
        yield hidden
        if place.exists():
            place.rename(former)
        hidden.rename(place)
    except BaseException:
        if former.exists():
            former.rename(place)
        shutil.rmtree(hidden, ignore_errors=True)
        raise
    shutil.rmtree(former, ignore_errors=True)


def _check_replaceable(place: Path, *, overwrite: bool) -> None:
    """Check that there is nothing, or a dataset that may be overwritten; raises OutputError."""
    if not place.exists() or (place.is_dir() and not any(place.iterdir())):
        return
    if not overwrite:
        raise OutputError(f"{place} exists: use --overwrite, another --out or another --name")
    if not (place / "data" / "metadata.json").exists():
        raise OutputError(f"{place} is not a Minari dataset, so it is not replaced")
    if others := [each.name for each in place.iterdir() if each.name != "data"]:
        raise OutputError(
            f"{place} is not replaced, since there is something else in it ({min(others)}): use "
            "another --out or another --name"
        )


def _plain(stem: str) -> str:
    return re.sub(r"[^A-Za-z0-9_-]+", "-", stem).strip("-") or "run"
