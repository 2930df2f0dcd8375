"""``realbench doctor``."""

from __future__ import annotations

import json
import time

import click

from real_bench.cli import options
from real_bench.cli.printing import say

EPILOG = """\b
Example:
  realbench doctor
"""

MEASURED_STEPS = 2000
MEASURED_IMAGES = 20


@click.command(epilog=EPILOG)
@options.scene_option
@options.json_option
def doctor(scene: str | None, as_json: bool) -> None:
    """Check that this machine can run the benchmark, and how fast."""
    from real_bench.cli.describing import print_facts
    from real_bench.lengths import INTRINSIC_STEPS
    from real_bench.physics import PHYSICS, REFERENCE
    from real_bench.provenance import run_versions
    from real_bench.simulation import DEFAULT_SCENE, HOME, Simulation, load_scene

    with Simulation(load_scene(scene or DEFAULT_SCENE)) as simulation:
        began = time.perf_counter()
        simulation.hold(HOME, MEASURED_STEPS)
        rate = MEASURED_STEPS / (time.perf_counter() - began)
        began = time.perf_counter()
        for _ in range(MEASURED_IMAGES):
            simulation.image()
        image_ms = (time.perf_counter() - began) / MEASURED_IMAGES * 1e3
        versions = run_versions()
        facts = {
            **versions,
            "physics_is_the_reference": versions[PHYSICS] == REFERENCE,
            "scene": simulation.scene.name,
            "scene_sha256": simulation.scene.sha256,
            "steps_per_second_at_rest": round(rate),
            "milliseconds_per_image": round(image_ms, 1),
            "minutes_for_a_full_phase_at_least": round(INTRINSIC_STEPS / rate / 60),
        }
    if as_json:
        say(json.dumps(facts))
    else:
        print_facts(facts)
        if facts["physics_is_the_reference"]:
            say("all is well")
        else:
            say(
                "everything runs, but with different physics than the reference: pybullet was "
                "compiled differently, or this processor computes differently. Results made here "
                "replay bit for bit only on machines like this one, and may differ from published "
                "ones beyond chance."
            )
