"""How fast a recording feeds whoever trains on it: times, and ratios to the bare reads they need.

    python evaluation/bench_reading.py [--run run.h5] [--actions 400] [--rounds 5]

Without a recording, REAL-R plays one of so many actions first, in scene official. Each round
measures, one right after the other:

* a random image: `recording.images(i, 1)`, beside the bare read of it by h5py, and beside opening
  the recording again for it, as it was done before;
* a random triplet with both images: `recording[i]`;
* all images, beside the bare read of all by h5py; and what that makes for a run of 15,001;
* a shuffled DataLoader with two workers, whole images and a cache of 80 x 60, beside one process
  that reads the same triplets.
"""

from __future__ import annotations

import statistics
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click
import h5py
import hdf5plugin  # noqa: F401  registers the compression of the images
import numpy as np
from rich.console import Console
from rich.table import Table
from torch.utils.data import DataLoader

from real_bench.conditions import Condition
from real_bench.phases.intrinsic import IntrinsicPhase
from real_bench.recording import Recording
from real_bench.simulation import load_scene

IMAGES_PER_RUN = 15_001
SMALL = (80, 60)
BATCH, WORKERS = 32, 2
WIDTH = 100

Rates = dict[str, float]


@contextmanager
def recording_of(path: Path | None, n_actions: int) -> Iterator[Path]:
    """The recording that is given, or one that is played now."""
    if path is not None:
        yield path
        return
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "run.h5"
        scene = load_scene("official")
        phase = IntrinsicPhase("real_r", Condition.parse("IM"), 1, scene, n_actions * 1000, 0, out)
        phase.run(lambda progress: None).close()
        yield out


def mean_seconds(function: Callable[[int], Any], numbers: Any) -> float:
    """What a call takes on average."""
    began = time.perf_counter()
    for number in numbers:
        function(int(number))
    return (time.perf_counter() - began) / len(numbers)


def measure(path: Path, seed: int) -> Rates:
    """One round: seconds an image or triplet."""
    random = np.random.default_rng(seed)
    rates: Rates = {}

    def reopened(number: int) -> Any:
        with Recording(path) as recording:
            return recording.images(number, 1)

    with Recording(path) as recording, h5py.File(path) as file:
        n_states, n_triplets = recording.n_states, len(recording)
        numbers = random.integers(0, n_states, 200)
        rates["random image"] = mean_seconds(lambda i: recording.images(i, 1), numbers)
        rates["random image, bare h5py"] = mean_seconds(lambda i: file["images"][i], numbers)
        rates["random image, file opened again"] = mean_seconds(reopened, numbers[:30])
        rates["random triplet"] = mean_seconds(
            recording.__getitem__, random.integers(0, n_triplets, 200)
        )
        rates["all images"] = mean_seconds(lambda _: recording.images(), [0]) / n_states
        rates["all images, bare h5py"] = mean_seconds(lambda _: file["images"][:], [0]) / n_states
        with tempfile.TemporaryDirectory() as cache:
            for name, dataset in (
                ("loader", recording.torch_dataset()),
                ("loader, cached 80 x 60", recording.torch_dataset(image_size=SMALL, cache=cache)),
            ):
                some = random.integers(0, n_triplets, 200)
                rates[f"{name}, one process"] = mean_seconds(dataset.__getitem__, some)
                rates[f"{name}, two workers"] = loaded(dataset)
    return rates


def loaded(dataset: Any) -> float:
    """Seconds a triplet from a shuffled loader, from its first batch on."""
    loader = DataLoader(dataset, BATCH, shuffle=True, num_workers=WORKERS, persistent_workers=True)
    for _ in loader:  # the workers have begun, and opened the file
        pass
    began, count = time.perf_counter(), 0
    while count < 2000:
        for batch in loader:
            count += len(batch["n_steps"])
    return (time.perf_counter() - began) / count


def table_of(rounds: list[Rates]) -> Table:
    """Medians, ratios to the bare read, and what was aimed at."""
    middle = {name: statistics.median(one[name] for one in rounds) for name in rounds[0]}

    def ratio(name: str, bare: str) -> str:
        ratios = [one[name] / one[bare] for one in rounds]
        return f"{statistics.median(ratios):.2f} ({min(ratios):.2f}, {max(ratios):.2f})"

    again = "random image, file opened again"
    table = Table(title=f"median of {len(rounds)} rounds (lowest, highest)")
    for heading in ("what", "here", "aimed at", "beside", "time / that"):
        table.add_column(heading, justify="left" if heading in ("what", "beside") else "right")
    for name in ("random image", "random triplet"):
        bare = "random image, bare h5py"
        here = f"{1000 * middle[name]:.2f} ms"
        table.add_row(name, here, "4 ms", "a bare h5py read", ratio(name, bare))
    table.add_row("", "", "", f"opening again: {1000 * middle[again]:.1f} ms",
                  ratio("random image", again))  # fmt: skip
    whole = IMAGES_PER_RUN * middle["all images"]
    bare = "all images, bare h5py"
    table.add_row(f"all images, for {IMAGES_PER_RUN:,}", f"{whole:.1f} s", "10 s",
                  "a bare h5py read", ratio("all images", bare))  # fmt: skip
    for name, aim in (("loader", "500 /s"), ("loader, cached 80 x 60", "-")):
        one, two = f"{name}, one process", f"{name}, two workers"
        table.add_row(f"{name}: triplets", f"{1 / middle[two]:,.0f} /s", aim,
                      f"one process: {1 / middle[one]:,.0f} /s", ratio(two, one))  # fmt: skip
    return table


@click.command()
@click.option("--run", "path", type=click.Path(path_type=Path, exists=True))
@click.option("--actions", default=400, show_default=True)
@click.option("--rounds", default=5, show_default=True)
def main(path: Path | None, actions: int, rounds: int) -> None:
    """Measure and print."""
    with recording_of(path, actions) as recording:
        measure(recording, 0)  # warms up
        console = Console()
        console.width = max(console.width, WIDTH)
        console.print(table_of([measure(recording, seed) for seed in range(rounds)]))


if __name__ == "__main__":
    main()
