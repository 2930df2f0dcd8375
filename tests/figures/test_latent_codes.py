"""What is seen with the weights of a recording, and what is learned anew."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest

from real_bench.conditions import Condition
from real_bench.figures import FigureOptions, Play
from real_bench.real_x.foreground import ForegroundSettings
from real_bench.real_x.latents import Latents, VAESettings
from real_bench.recording import Experience, Recording
from tests.figures.bench import FEW_STEPS, read


def seen(path: Path, **options: object) -> Play:
    (play,) = read(path, options=FigureOptions(**options))  # type: ignore[arg-type]
    assert play.sight is not None
    return play


def codes(play: Play) -> list[list[float]]:
    assert play.sight is not None
    states: list[list[float]] = play.sight.codes.states.tolist()
    return states


def test_recorded_weights_are_used_whatever_the_seed(folder: Path) -> None:
    one, other = seen(folder / "learned.h5"), seen(folder / "learned.h5", seed=5)
    assert one.sight is not None
    assert one.sight.is_recorded
    assert one.sight.settings["vae"]["steps"] == 5
    assert codes(one) == codes(other)
    with Recording(folder / "learned.h5") as recording:
        latents = Latents(ForegroundSettings(), VAESettings(steps=5))
        latents.set_state(recording.controller_state()["perception"])
    triplets = latents.triplets(Experience(folder / "learned.h5", Condition.parse("IM")))
    np.testing.assert_array_equal(one.sight.codes.states, triplets.states)


@pytest.mark.parametrize(
    "options",
    [
        {"settings": {"vae": {"steps": 6}}},
        {"run_steps": 3000},
        {"settings": {"vae": {"hidden": 9}}},
    ],
)
def test_vae_is_retrained_for_other_settings_or_fewer_steps(
    folder: Path, options: dict[str, object]
) -> None:
    one, again = seen(folder / "learned.h5", **options), seen(folder / "learned.h5", **options)
    other = seen(folder / "learned.h5", seed=5, **options)
    assert one.sight is not None
    assert not one.sight.is_recorded
    assert codes(one) == codes(again) != codes(other)


@pytest.mark.parametrize(
    ("name", "older"), [(b'"hidden"', b'"hiding"'), (b'"mean.bias"', b'"bias.mean"')]
)
def test_vae_is_retrained_where_recorded_weights_are_outdated(
    folder: Path, tmp_path: Path, name: bytes, older: bytes
) -> None:
    old = tmp_path / "old.h5"
    old.write_bytes((folder / "learned.h5").read_bytes())
    with h5py.File(old, "r+") as file:
        text = file["controller_state/structure"][()].tobytes()
        assert name in text
        file["controller_state/structure"][...] = np.frombuffer(text.replace(name, older), np.uint8)
    play = seen(old, settings=FEW_STEPS)
    assert play.sight is not None
    assert not play.sight.is_recorded


def test_vae_is_trained_on_a_play_without_weights(folder: Path) -> None:
    play = seen(folder / "pushed.h5", settings=FEW_STEPS)
    assert play.sight is not None
    assert not play.sight.is_recorded
