"""Scene official is the official environment, to the last bit.

Once against the full recordings, which may lie beside the repository, and always against the
numbers kept from them in tests/data.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from real_bench.controls import CONTROLS
from real_bench.simulation import Scene, Simulation

RECORDINGS = ("cartesian_1", "grasp_1", "joints_1", "joints_2", "macro_1", "macro_3", "macro_end")
FACTS = json.loads((Path(__file__).parents[1] / "data" / "parity.json").read_text())
LETTER = {"cartesian": "C", "joints": "J", "macro_action": "M"}


def replay(
    simulation: Simulation, kind: str, commands: Any, n_steps: Any, stops: list[int]
) -> Iterator[tuple[int, bool]]:
    """Follow the commands; yields (step, whether a command ends here) at each stop and end."""
    control = CONTROLS[LETTER[kind]]()
    step = 0
    for command, duration in zip(np.array(commands, float), n_steps, strict=True):
        end = step + int(duration)
        while step < end:
            until = min([stop for stop in stops if stop > step] + [end])
            until = min(until, end)
            simulation.follow(control.segments(command, until - step, simulation))
            step = until
            yield step, step == end


@pytest.mark.parametrize("name", RECORDINGS)
def test_parity_with_the_recording(name: str, official_scene: Scene, shared: Path) -> None:
    recorded = np.load(shared / "parity" / f"{name}.npz")
    stops = recorded["sampled_step"].tolist()
    n_images = 0
    with Simulation(official_scene, len(recorded["objects"])) as simulation:
        assert np.array_equal(simulation.image().retina, recorded["first_image"])
        for step, is_end in replay(
            simulation, str(recorded["kind"]), recorded["commands"], recorded["n_steps"], stops
        ):
            if step in stops:
                row = stops.index(step)
                for sense in ("joint_positions", "touch_sensors", "object_poses"):
                    assert np.array_equal(getattr(simulation, sense)(), recorded[sense][row]), (
                        f"{sense} at step {step}"
                    )
            if is_end:
                image = simulation.image()
                senses: list[np.ndarray[Any, Any]] = [image.retina, image.depth, image.mask]
                for ours, theirs in zip(senses, ("image", "depth", "segmentation"), strict=True):
                    assert np.array_equal(ours, recorded[theirs][n_images]), f"{theirs} at {step}"
                n_images += 1
    assert n_images == len(recorded["image"])


@pytest.mark.parametrize("name", RECORDINGS)
def test_parity_with_the_numbers_kept(name: str, official_scene: Scene) -> None:
    facts = FACTS[name]
    samples = {sample["step"]: sample for sample in facts["samples"]}
    seen = 0
    with Simulation(official_scene, facts["n_objects"]) as simulation:
        for step, _ in replay(
            simulation, facts["kind"], facts["commands"], facts["n_steps"], list(samples)
        ):
            if step in samples:
                seen += 1
                for sense in ("joint_positions", "touch_sensors", "object_poses"):
                    assert getattr(simulation, sense)().tolist() == samples[step][sense]
        image = simulation.image()
    assert seen == len(samples)
    assert digest(image.retina) == facts["last_image"]["retina"]
    assert digest(image.depth.astype("<f4")) == facts["last_image"]["depth"]
    assert digest(image.mask.astype("<i2")) == facts["last_image"]["mask"]


def digest(array: np.ndarray[Any, Any]) -> str:
    return hashlib.sha256(np.ascontiguousarray(array).tobytes()).hexdigest()
