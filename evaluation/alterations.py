"""Alter a result a hundred times, one field at a time, and count what is found.

python evaluation/alterations.py score.json

Each time one number or text, drawn at random, is changed. First the file is left as it then is, and
only read: its seal must tell. Then it is left as a forger would leave it, sealed anew, where the
field is one that a replay can prove (all but those that docs/verification.md names), and is
replayed. A trial that is as it was before is replayed only once, since it ends as it did: `--whole`
replays all of them every time, which takes as long as some fifty tests.
"""

from __future__ import annotations

import copy
import json
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

import click
import numpy as np

from real_bench.errors import RealBenchError
from real_bench.scoring.result import TrialResult, load_result
from real_bench.scoring.result_file import sealed
from real_bench.verification import ResultVerification, TrialCheck, results
from real_bench.verification.trials import TrialReplayer

NOT_PROVED = (
    *("controller", "controller_sha256", "settings", "run_sha256", "run_steps"),
    *("seed", "versions"),
)
"""Fields of the setting that no replay proves; times are not proved either."""

Place = tuple[Any, ...]


class CachingReplayer(TrialReplayer):
    """Replays a trial that it has seen no second time."""

    cache: ClassVar[dict[str, TrialCheck]] = {}

    def check(self, trial: TrialResult) -> TrialCheck:
        """What came of replaying this very trial."""
        key = trial.model_dump_json()
        if key not in self.cache:
            self.cache[key] = super().check(trial)
        return self.cache[key]


def leaves(content: Any, place: Place = ()) -> Iterator[Place]:
    """Where every number and text is."""
    if isinstance(content, dict | list):
        for key in content if isinstance(content, dict) else range(len(content)):
            yield from leaves(content[key], (*place, key))
    else:
        yield place


def alter(content: dict[str, Any], place: Place, random: np.random.Generator) -> None:
    """Change one value: a number by up to a tenth of it, a text in one letter."""
    holder: Any = content
    for key in place[:-1]:
        holder = holder[key]
    value = holder[place[-1]]
    if isinstance(value, bool):
        value = not value
    elif isinstance(value, int):
        value += int(random.integers(1, 5))
    elif isinstance(value, float):
        value = value * (1 + random.uniform(1e-9, 0.1)) if value else 1e-9
    else:
        at = int(random.integers(len(value) + 1))
        value = value[:at] + random.choice(list("abcdef0123456789")) + value[at:]
    holder[place[-1]] = value


def fate_when_read(path: Path, goals: Path | None) -> str:
    """What becomes of a file that is read."""
    try:
        load_result(path)
    except RealBenchError:
        return "refused"
    return "PASSED"


def fate_when_verified(path: Path, goals: Path | None) -> str:
    """What ``realbench verify`` makes of a file."""
    try:
        verdict = ResultVerification(path, goals).verify(lambda done, total: None)
    except RealBenchError:
        return "refused"
    if verdict.holds:
        return "PASSED"
    return "replay differs" if verdict.different else "fault beside the trials"


@click.command()
@click.argument("result", type=click.Path(path_type=Path, exists=True))
@click.option("--goals", type=click.Path(path_type=Path, exists=True))
@click.option("--number", default=100, show_default=True)
@click.option("--seed", default=0, show_default=True)
@click.option("--whole", is_flag=True, help="Replay every trial of every altered file.")
def main(result: Path, goals: Path | None, number: int, seed: int, whole: bool) -> None:
    """Print how many of the alterations were found, and how."""
    if not whole:
        results.TrialReplayer = CachingReplayer  # type: ignore[attr-defined]
    honest, random = json.loads(result.read_text()), np.random.default_rng(seed)
    print(f"{result} as it is: {fate_when_verified(result, goals)}", flush=True)
    everywhere = list(leaves(honest))
    provable = [
        place
        for place in everywhere
        if place[-1] != "seal" and place[0] != "timing" and not set(NOT_PROVED) & set(place)
    ]
    for how, places, fate in (
        ("unsealed and read", everywhere, fate_when_read),
        ("sealed anew and replayed", provable, fate_when_verified),
    ):
        fates: Counter[str] = Counter()
        for k in random.choice(len(places), number):
            content = copy.deepcopy(honest)
            alter(content, places[k], random)
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / "altered.json"
                path.write_text(json.dumps(sealed(content) if places is provable else content))
                found = fate(path, goals)
            fates[found] += 1
            if found == "PASSED":
                print("passed:", places[k], flush=True)
        summary = ", ".join(f"{n} {name}" for name, n in fates.items())
        print(f"{number} alterations, {how}, of {len(places)} fields: {summary}", flush=True)


if __name__ == "__main__":
    main()
