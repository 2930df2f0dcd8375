from __future__ import annotations

import copy
import pickle
from pathlib import Path

import numpy as np
import pytest

from real_bench.conditions import Condition
from real_bench.errors import RecordingError
from real_bench.recording import Experience, Recording

OM, IM = Condition.parse("OM"), Condition.parse("IM")


def test_experience_matches_the_recorded_triplets(cut_path: Path, cut_run: Recording) -> None:
    experience = Experience(cut_path, OM)
    rows, images = cut_run.transitions, cut_run.images()
    assert len(experience) == len(rows)
    positions = cut_run.object_poses[:, :, :3]
    np.testing.assert_array_equal(experience.positions_before(), positions[rows["precondition"]])
    np.testing.assert_array_equal(experience.positions_after(), positions[rows["outcome"]])
    turns = cut_run.object_poses[:, :, 3:]
    np.testing.assert_array_equal(experience.orientations_before(), turns[rows["precondition"]])
    np.testing.assert_array_equal(experience.orientations_after(), turns[rows["outcome"]])
    np.testing.assert_array_equal(experience.joint_positions, cut_run.states["joint_positions"])
    np.testing.assert_array_equal(experience.map_images(np.array), images)
    means = experience.map_images(lambda image: float(image.mean()))  # a number, not an array
    np.testing.assert_array_equal(means, [image.mean() for image in images])
    for i, row in enumerate(rows):
        np.testing.assert_array_equal(experience.image_before(i), images[row["precondition"]])
        np.testing.assert_array_equal(experience.image_after(i), images[row["outcome"]])


def test_actions_keep_their_durations(cut_path: Path, cut_run: Recording) -> None:
    experience = Experience(cut_path, OM)
    durations = [experience.action(i).duration for i in range(len(experience))]
    assert durations == cut_run.transitions["n_steps"].tolist()


def test_copied_and_pickled_experience_is_the_same(cut_path: Path) -> None:
    experience = Experience(cut_path, OM)
    for twin in (copy.deepcopy(experience), pickle.loads(pickle.dumps(experience))):
        np.testing.assert_array_equal(twin.positions_after(), experience.positions_after())
        np.testing.assert_array_equal(twin.image_after(2), experience.image_after(2))


def test_image_condition_gets_no_positions(cut_path: Path) -> None:
    experience = Experience(cut_path, IM)
    assert experience.image_before(0).any()
    for positions in (
        experience.positions_before,
        experience.positions_after,
        experience.orientations_before,
        experience.orientations_after,
    ):
        with pytest.raises(RecordingError, match="no positions"):
            positions()
    assert not any(np.shape(value)[1:] == (2, 7) for value in vars(experience).values())


def test_recording_of_an_image_condition_has_no_positions(image_path: Path) -> None:
    with pytest.raises(RecordingError, match="no positions"):
        Experience(image_path, OM).positions_after()


def test_shorter_experience_holds_only_its_first_steps(cut_path: Path) -> None:
    whole = Experience(cut_path, OM)
    ends = np.cumsum(whole.durations)
    for n_actions in range(len(whole) + 1):
        short = Experience(cut_path, OM, int(ends[n_actions - 1]) if n_actions else 0)
        assert len(short) == n_actions
        np.testing.assert_array_equal(short.outcomes, whole.outcomes[:n_actions])
        np.testing.assert_array_equal(short.positions_after(), whole.positions_after()[:n_actions])
        n_states = int(short.outcomes.max(initial=-1)) + 1
        if n_actions < len(whole):
            assert short.n_states == len(short.joint_positions) == n_states
            assert len(short.map_images(np.array)) == n_states


@pytest.mark.parametrize("first", [0, 1, 2])
def test_what_followed_is_the_rest(cut_path: Path, first: int) -> None:
    experience = Experience(cut_path, OM)
    rest = experience.since(first)
    state = int(experience.preconditions[first])
    assert len(rest) == len(experience) - first
    assert rest.preconditions[0] == 0
    np.testing.assert_array_equal(rest.positions_before(), experience.positions_before()[first:])
    np.testing.assert_array_equal(rest.positions_after(), experience.positions_after()[first:])
    np.testing.assert_array_equal(rest.joint_positions, experience.joint_positions[state:])
    images = experience.map_images(np.array)
    np.testing.assert_array_equal(rest.map_images(np.array), images[state:])
    for i in range(len(rest)):
        np.testing.assert_array_equal(rest.image_after(i), experience.image_after(first + i))
        expected = experience.action(first + i)
        np.testing.assert_array_equal(rest.action(i).commands, expected.commands)


def test_nothing_follows_the_last_action(cut_path: Path) -> None:
    experience = Experience(cut_path, OM)
    for first in (len(experience), len(experience) + 3):
        rest = experience.since(first)
        assert len(rest) == rest.n_states == len(rest.joint_positions) == 0
        assert rest.map_images(np.array).shape == (0,)


def test_trials_cannot_change_what_they_share(cut_path: Path) -> None:
    experience = copy.deepcopy(Experience(cut_path, "OM"))
    shown = ("joint_positions", "durations", "preconditions", "outcomes")
    for part in (experience, experience.since(1)):
        for name in shown:
            with pytest.raises(ValueError, match="read-only"):
                getattr(part, name)[:] = 0
    experience.positions_after()[:] = 0  # a copy of one's own
    assert experience.positions_after().any()
