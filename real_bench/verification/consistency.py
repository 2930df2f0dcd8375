"""Whether a recording contradicts itself, found without simulating anything."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from real_bench.recording import Recording
from real_bench.recording.schema import STATE, TRANSITION, chained_sha256, command_type
from real_bench.replay import fresh_states
from real_bench.simulation.scene import Scene

ACTIONS_AT_ONCE = 100
"""Actions whose commands are held in memory; up to 1000 rows each."""


def commands_match_hash(recording: Recording) -> bool:
    """Whether the commands match their hash; old recordings have none."""
    rows, found = recording.transitions, ""
    for first in range(0, len(rows), ACTIONS_AT_ONCE):
        counts = rows["n_commands"][first : first + ACTIONS_AT_ONCE]
        commands = recording.commands(int(rows["first_command"][first]), int(counts.sum()))
        found = chained_sha256(found, counts, commands)
    return recording.commands_sha256 in (None, found)


def contradictions(recording: Recording, scene: Scene) -> Iterator[str]:
    """All contradictions within a recording, or with its scene.

    Raises:
        RecordingError: it cannot be read.
    """
    header = recording.header
    if header.scene_sha256 != scene.sha256:
        yield f"it was made in another scene than {scene.name} ({scene.sha256[:12]})"
    elif (header.scene, header.object_names) != (scene.name, scene.object_names(header.objects)):
        yield f"it names another scene or other objects than {scene.name} has"
    shape_contradictions = list(_shape_contradictions(recording))
    yield from shape_contradictions
    if not shape_contradictions:
        yield from _count_contradictions(recording)
        yield from _non_finite_values(recording)


def _shape_contradictions(recording: Recording) -> Iterator[str]:
    header, states = recording.header, recording.states
    size = header.command_size
    if recording.transitions.dtype != TRANSITION or states.dtype != STATE:
        yield "its transitions or states have other fields"
    if recording.commands(0, 1).dtype != command_type(size):
        yield f"its commands are not those of condition {header.condition}"
    poses = recording.object_poses
    if poses.dtype != np.float64 or poses.shape != (recording.n_states, header.objects, 7):
        yield f"its object poses are of shape {poses.shape}"
    if header.images != (recording.n_images is not None):
        yield "it has images but says that it has none, or vice versa"


def _count_contradictions(recording: Recording) -> Iterator[str]:
    rows, steps = recording.transitions, recording.states["step"]
    before, after = rows["precondition"], rows["outcome"]
    if (rows["n_steps"] < 1).any():
        yield "an action has n_steps below 1"
    ends = rows["first_step"] + rows["n_steps"]
    if (steps[before] != rows["first_step"]).any() or (steps[after] != ends).any():
        yield "a state is not of the step that its action begins or ends at"
    begun_at = [0, *recording.cuts] if recording.n_states else []
    if steps[fresh_states(recording)].tolist() != begun_at:
        yield "worlds do not begin where the run was cut"
    if recording.n_steps > recording.total_steps:
        yield f"it has {recording.n_steps:,} steps, {recording.total_steps:,} were asked for"
    if recording.ended and recording.n_steps < recording.total_steps:
        yield "it says that it has ended, but it has not"


def _non_finite_values(recording: Recording) -> Iterator[str]:
    states = recording.states
    for name in ("joint_positions", "touch_sensors"):
        if not np.isfinite(states[name]).all():
            yield f"some {name} are not numbers"
    if not np.isfinite(recording.object_poses).all():
        yield "some object poses are not numbers"
