"""A fingerprint of this machine's physics.

The same commands move objects differently if pybullet was compiled differently, or if the maths
library chooses other instructions for another processor: by the last bit at first, by metres after
a few pushes. No version number shows that. So the outcome of a fixed short simulation is hashed:
recordings and results replay bit for bit exactly on machines with the same hash.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from functools import cache

from real_bench.text.counting import tallied_if_mixed
from real_bench.text.quoting import quoted

PHYSICS = "physics"
"""The fingerprint's name among the versions of recordings and results."""

REFERENCE = "3183ea3a179b7b3c"
"""Of pybullet 3.2.7 from PyPI (x86-64, Linux) on processors with AVX2, where all kept results and
the comparisons with the official environment were made."""

SCENE = "builtin"  # ships with the package
N_OBJECTS = 3
SWEEP = (-0.1, -0.45, -0.1, 0.45)  # a macro that pushes all three
WAY_HOME = 3
"""The last commands of a macro, which no longer push anything."""

UNKNOWN = "unknown"


@cache
def fingerprint() -> str:
    """The fingerprint, 16 hexadecimal digits; the first call simulates for about 0.2 s."""
    import numpy as np

    from real_bench.controls.macro import plan_macro
    from real_bench.simulation import Simulation, load_scene

    digest = hashlib.sha256()
    with Simulation(load_scene(SCENE), N_OBJECTS) as simulation:
        for command, n_steps in plan_macro(SWEEP, simulation)[:-WAY_HOME]:
            simulation.hold(command, n_steps)
            for numbers in (command, simulation.joint_positions(), simulation.object_poses()):
                digest.update(np.asarray(numbers, "<f8").tobytes())
    return digest.hexdigest()[:16]


def physics_of(versions: Mapping[str, str]) -> str:
    """The fingerprint that a recording or result keeps; ``unknown`` if it is older."""
    return versions.get(PHYSICS, UNKNOWN)


def mixture(fingerprints: Sequence[str]) -> str:
    """A remark on scores with different physics; empty if there is only one."""
    counts = tallied_if_mixed(map(quoted, fingerprints))
    if not counts:
        return ""
    if len({*fingerprints} - {UNKNOWN}) > 1:
        told = f"results with different physics are mixed ({counts})"
        return f"{told}: the same commands end differently"
    told = f"results with different physics may be mixed ({counts})"
    return f"{told}: the same commands may end differently"
