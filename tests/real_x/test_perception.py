from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from real_bench.controllers.real_d import RealD, RealDSettings

from real_bench.conditions import Condition
from real_bench.errors import RealBenchError
from real_bench.phases.intrinsic import IntrinsicPhase
from real_bench.real_x import BlurredImages, ObjectPositions
from real_bench.recording import Experience, Recording
from real_bench.simulation import Scene
from real_bench.spaces import action_space, observation_space
from tests.recording.bench import ignore

OM, IM = Condition.parse("OM"), Condition.parse("IM")


@pytest.fixture(scope="module")
def run(builtin_scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Twenty actions with images: more than are compressed together."""
    out = tmp_path_factory.mktemp("run") / "run.h5"
    phase = IntrinsicPhase("real_r", OM, 1, builtin_scene, 20_000, 3, out, images=True)
    phase.run(ignore)
    return out


def test_each_state_matches_the_image_it_comes_from(run: Path) -> None:
    perception = BlurredImages(8, 6, 1.0)
    triplets = perception.triplets(Experience(run, IM))
    with Recording(run) as recording:
        rows, images = recording.transitions, recording.images()
    assert len(triplets) == len(rows) == 20
    for number, row in enumerate(rows):
        for table, name, key in (
            (triplets.states, "precondition", "retina"),
            (triplets.outcomes, "outcome", "goal"),
        ):
            image = images[row[name]]
            read = perception.state if key == "retina" else perception.goal
            np.testing.assert_array_equal(table[number], read({key: image}))


def test_image_states_have_no_positions(run: Path) -> None:
    perception = BlurredImages(8, 6, 1.0)
    assert perception.positions(np.zeros((2, 48))) is None


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 14), st.integers(0, 19))
def test_strong_blur_spreads_a_change_to_every_cell(row: int, column: int) -> None:
    """And in focus only those where something moved."""
    before = np.full((240, 320, 3), 100, np.uint8)
    after = before.copy()
    after[16 * row : 16 * row + 16, 16 * column : 16 * column + 16] = 200

    def changed(blur: float) -> np.ndarray:
        perception = BlurredImages(20, 15, blur)
        return np.asarray(
            perception.state({"retina": before}) != perception.state({"retina": after})
        )

    assert changed(3.0).all()
    assert np.flatnonzero(changed(0.0)).tolist() == [20 * row + column]


def test_real_d_uses_positions_where_seen_and_images_otherwise(builtin_scene: Scene) -> None:
    for condition, expected in ((OM, ObjectPositions), (IM, BlurredImages)):
        spaces = (
            action_space(builtin_scene, condition),
            observation_space(builtin_scene, condition, 1),
        )
        assert isinstance(RealD(*spaces, RealDSettings())._perception, expected)


def test_more_cells_than_fit_into_memory_are_refused() -> None:
    class Many:
        def __len__(self) -> int:
            return 15_000

    with pytest.raises(RealBenchError, match=r"320 x 240 cells would take 64\.5 GB .* fewer cells"):
        BlurredImages(320, 240, 3.0).triplets(Many())  # type: ignore[arg-type]
