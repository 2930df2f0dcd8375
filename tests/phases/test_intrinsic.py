from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from real_bench.errors import Interrupted, RealBenchError
from real_bench.files.atomic import OutputError
from real_bench.recording import Recording
from real_bench.text.naming import shareable_name
from tests.phases.conftest import Play, toy


@pytest.mark.parametrize("controller", ["series:Macros", "series:StepMacros"])
@pytest.mark.parametrize("steps", [1, 999, 1000, 2345])
def test_a_phase_lasts_exactly_as_long_as_asked(play: Play, steps: int, controller: str) -> None:
    with Recording(play(toy(controller), steps)) as recording:
        assert recording.n_steps == recording.total_steps == steps
        assert recording.transitions["n_steps"].sum() == steps
        assert recording.commands()["n_steps"].sum() == steps
        assert recording.states["step"][-1] == steps


def test_stepwise_calls_and_whole_actions_record_the_same(play: Play) -> None:
    paths = [
        play(toy(f"series:{kind}"), 3700, images=True, out=kind)
        for kind in ("Macros", "StepMacros")
    ]
    with Recording(paths[0]) as whole, Recording(paths[1]) as stepped:
        assert whole.displacements().max() > 0.01
        np.testing.assert_array_equal(whole.object_poses, stepped.object_poses)
        np.testing.assert_array_equal(whole.states, stepped.states)
        np.testing.assert_array_equal(whole.images(), stepped.images())
        np.testing.assert_array_equal(whole.commands(), stepped.commands())


@pytest.mark.parametrize("condition", ["OM", "OJ", "OC"])
def test_the_same_seed_gives_the_same_run(play: Play, condition: str) -> None:
    paths = [
        play("real_r", 3000, condition=condition, objects=2, seed=seed, out=name)
        for name, seed in (("one", 4), ("same", 4), ("other", 5))
    ]
    one, same, other = map(content, paths)
    assert all(a.tobytes() == b.tobytes() for a, b in zip(one, same, strict=True))
    assert one[0].tobytes() != other[0].tobytes()


def content(path: Path) -> tuple[np.ndarray, ...]:
    with Recording(path) as recording:
        return (
            recording.commands(),
            recording.states,
            recording.object_poses,
            recording.transitions,
        )


def test_images_are_recorded_in_image_conditions_or_on_request(play: Play) -> None:
    for condition, images, n_images in (("IM", None, 3), ("OM", None, None), ("OM", True, 3)):
        path = play("real_r", 2000, condition=condition, images=images, overwrite=True)
        with Recording(path) as recording:
            assert recording.header.images == (n_images is not None)
            assert recording.n_images == n_images


def test_header_records_what_was_played(play: Play) -> None:
    controller = toy("series:Macros")
    with Recording(play(controller, 1000, objects=3, seed=8)) as recording:
        header = recording.header
    assert (header.condition, header.objects, header.seed) == ("OM", 3, 8)
    assert header.controller == shareable_name(controller)
    assert len(header.object_names) == 3
    assert len(header.controller_sha256) == 64


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"steps": 0}, "steps must"),
        ({"seed": -1}, "seed must"),
        ({"objects": 4}, "objects"),
        ({"condition": "IM", "images": False}, "images"),
        ({"controller": "nobody"}, "real_r"),
    ],
)
def test_bad_play_options_are_refused(
    play: Play, tmp_path: Path, change: dict[str, object], complaint: str
) -> None:
    with pytest.raises(RealBenchError, match=complaint):
        play(**{"controller": "real_r", "steps": 1000, **change})
    assert list(tmp_path.iterdir()) == []


def test_recording_is_overwritten_only_on_request(play: Play) -> None:
    before = play("real_r", 1000).read_bytes()
    with pytest.raises(OutputError, match="--overwrite"):
        play("real_r", 2000)
    assert Path("run.h5").read_bytes() == before
    with Recording(play("real_r", 1500, overwrite=True)) as recording:
        assert recording.n_steps == 1500


def test_play_that_is_stopped_before_its_first_action_leaves_what_was_there(play: Play) -> None:
    path = play("real_r", 1000)
    before = path.read_bytes()
    with pytest.raises(Interrupted, match="stopped before the first action: nothing was recorded"):
        play(toy("faulty:StoppedEarly"), 3000, overwrite=True)
    assert path.read_bytes() == before
    with pytest.raises(Interrupted, match="stopped before the first action"):
        play(toy("faulty:StoppedEarly"), 3000, out="new.h5")
    assert not path.with_name("new.h5").exists()
