"""The paper's analyses of a recording with images, as one JSON.

python evaluation/analyses.py om0.h5 --out om0-analyses.json
python evaluation/analyses.py om0.h5 --set vae.weight=1
"""

from __future__ import annotations

import json
import logging
import sys
import time
from pathlib import Path

import click
import numpy as np
from real_bench.controllers.real_ld import RealLDSettings

from real_bench import analysis
from real_bench.conditions import Condition
from real_bench.files import file_sha256
from real_bench.real_x import DynamicAbstraction
from real_bench.real_x.home import plannable
from real_bench.real_x.latents import Latents
from real_bench.real_x.triplets import Triplets
from real_bench.recording import MOVED_M, Experience, Recording, package_versions
from real_bench.settings import read_settings

N_PAIRS = 100_000
BINS_M = np.arange(0, 1.01, 0.05)


def correlations(pairs: analysis.PairDistances) -> dict[str, float]:
    """Both correlations, rounded."""
    return {"spearman": round(pairs.spearman, 3), "pearson": round(pairs.pearson, 3)}


@click.command()
@click.argument("run", type=click.Path(path_type=Path, exists=True))
@click.option("--set", "assignments", multiple=True, metavar="NAME=VALUE")
@click.option("--run-steps", type=int)
@click.option("--seed", type=int, default=0, show_default=True)
@click.option("--out", type=click.Path(path_type=Path))
def main(
    run: Path, assignments: tuple[str, ...], run_steps: int | None, seed: int, out: Path | None
) -> None:
    """Learn to see as REAL-LD does, and compare with where the objects truly were."""
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    settings = RealLDSettings.model_validate(read_settings(None, assignments))
    with Recording(run) as recording:
        condition = Condition.parse("I" + Condition.parse(recording.header.condition).control)
        displacements, poses = recording.displacements(), recording.object_poses
    experience = Experience(run, condition, run_steps)
    kept, began = plannable(experience), time.monotonic()
    perception = Latents(settings.eye, settings.vae)
    perception.seed(seed)
    seen = perception.triplets(experience)
    seconds = time.monotonic() - began
    triplets = Triplets(seen.states[kept], seen.outcomes[kept])
    positions = poses[experience.preconditions[kept], :, :3]
    random = np.random.default_rng(seed)
    pairs = analysis.pair_distances(triplets.states, positions, N_PAIRS, random)
    displacements = displacements[: len(experience)]
    lengths = analysis.action_lengths(displacements)
    moves = analysis.moves_by_period(displacements)
    abstraction = DynamicAbstraction.learn(triplets)
    facts = {
        "command": " ".join(["python evaluation/analyses.py", *sys.argv[1:]]),
        "run": {"file": run.name, "sha256": file_sha256(run), "actions": len(experience)},
        "actions_planned_with": len(kept),
        "settings": settings.model_dump(mode="json"),
        "seconds_to_learn_to_see": round(seconds, 1),
        "latent_against_real": {
            "all": correlations(pairs),
            "1-20 cm": correlations(pairs.within(*analysis.NEAR_M)),
        },
        "actions_that_moved_an_object": {
            "all": int((displacements.max(axis=1, initial=0) > MOVED_M).sum()),
            "by_500": moves.tolist(),
            "share_shorter_than_20_cm": round(float((lengths < analysis.NEAR_M[1]).mean()), 3),
            "by_5_cm": np.histogram(lengths, BINS_M)[0].tolist(),
        },
        "effective_actions_by_level": analysis.effective_actions(triplets, abstraction).tolist(),
        "versions": package_versions(),
    }
    text = json.dumps(facts, indent=1)
    if out is not None:
        out.write_text(text + "\n")
    click.echo(text)


if __name__ == "__main__":
    main()
