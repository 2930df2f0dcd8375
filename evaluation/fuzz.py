"""Feed the readers broken files: only our own errors may come out, in little time and memory.

python evaluation/fuzz.py --minutes 10

Files of every kind are made, and bytes and words of them changed, cut, repeated and swapped. Each
is read in a process with a limit on memory; one that dies, hangs, or raises something else is kept.
"""

from __future__ import annotations

import json
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from multiprocessing import get_context
from pathlib import Path

import click
from rich.console import Console
from rich.table import Table

from real_bench.conditions import Condition
from real_bench.errors import RealBenchError
from real_bench.experiments import read_spec
from real_bench.goal_sets import load_goal_set
from real_bench.recording import Experience, Recording
from real_bench.scoring.result import load_result
from real_bench.settings import read_settings
from real_bench.simulation.scene import manifest_path, read_manifest
from real_bench.watching import read_status

REALBENCH = str(Path(sys.executable).with_name("realbench"))
MEMORY, SECONDS, FILES_PER_PROCESS = 4 << 30, 20, 200
SPEC = (
    "cells: [{controller: real_r, condition: OM, published: {mean: 0.1}}]\ngoals: {a: {seed: 3}}\n"
)
SETTINGS = "planner: {depth: 8}\nabstraction:\n  levels: 100\nimages: {blur: 0.5}\n"
WORDS = [b"&a [*a,*a]", b"!!python/object:os.system", b"1e999", b"-1", b"NaN", b"null", b"[", b"}"]
WORDS += [b"99999999999999999999", b"\x00", b"\xff\xfe", b"'", b'"', b"true", b"{}", b"2026-13-45"]


def read_recording(path: Path) -> None:
    """All that is read of a recording."""
    with Recording(path) as recording:
        recording.displacements()
        recording.controller_state()
        recording.images(0, 2)
        recording.commands()
        recording.to_numpy()
        if len(recording):
            recording[-1]
        read_status(path).to_json()
    experience = Experience(path, Condition.parse("OM"))
    if len(experience):
        experience.action(0)


READERS: dict[str, Callable[[Path], object]] = {
    "goals.npy": load_goal_set,
    "run.h5": read_recording,
    "score.json": load_result,
    "spec.yaml": read_spec,
    "settings.yaml": lambda path: read_settings(path, ()),
    "scene.yaml": read_manifest,
}


def examples(folder: Path) -> dict[str, bytes]:
    """A good file of each kind."""
    common = ["--controller", "real_r", "--condition", "OM", "--scene", "builtin"]
    few = ["--2d", "2", "--25d", "0", "--3d", "0", "--scene", "builtin"]
    for command in (
        ["goals", "generate", "--seed", "1", *few],
        ["intrinsic", *common, "--steps", "5000", "--images"],
        ["extrinsic", *common, "--goals", "goals.npy", "--run", "run.h5"],
    ):
        subprocess.run([REALBENCH, *command], cwd=folder, check=True, capture_output=True)
    (folder / "spec.yaml").write_text(SPEC)
    (folder / "settings.yaml").write_text(SETTINGS)
    (folder / "scene.yaml").write_bytes(manifest_path("builtin").read_bytes())
    return {name: (folder / name).read_bytes() for name in READERS}


def corrupt(content: bytes, generator: random.Random) -> bytes:
    """The same with a few things wrong."""
    data = bytearray(content)
    for _ in range(generator.choice((1, 1, 2, 4, 16))):
        # what a file says of itself stands at its beginning, mostly
        end = max(1, len(data) if generator.random() < 0.5 else min(len(data), 4096))
        at, other = generator.randrange(end), generator.randrange(end)
        length = generator.choice((1, 2, 4, 8, 64, 1000))
        match generator.randrange(6):
            case 0:
                data[at : at + 1] = bytes([generator.randrange(256)])
            case 1:
                data[at : at + length] = b""
            case 2:
                data[at:at] = data[other : other + length]
            case 3:
                data[at : at + length] = data[other : other + length]
            case 4:
                word = generator.choice(WORDS)
                data[at : at + generator.choice((0, len(word)))] = word
            case _:
                size = generator.choice((2, 4, 8))
                number = generator.choice((0, 1, 2**15, 2**31 - 1, 2**63 - 1, 2**64 - 1))
                data[at : at + size] = (number % 256**size).to_bytes(size, "little")
    return bytes(data)


def read_many(folder: Path, contents: dict[str, bytes], seed: int, until: float) -> None:
    """Read broken files; says of each what came of it. Runs in a process of its own."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    generator, log = random.Random(seed), (folder / "told").open("w", buffering=1)
    for _ in range(FILES_PER_PROCESS):
        if time.monotonic() > until:
            break
        name = generator.choice(list(READERS))
        path = folder / name
        path.write_bytes(corrupt(contents[name], generator))
        log.write(f"{name} ")
        signal.alarm(SECONDS)  # whoever does not answer in time is ended by it
        try:
            READERS[name](path)
            log.write("read\n")
        except RealBenchError:
            log.write("refused\n")
        except BaseException as error:
            log.write(f"{type(error).__name__}: {' '.join(str(error).split())[:200]}\n")
            keep(path)
        signal.alarm(0)


def keep(path: Path) -> None:
    """Keep a file that somebody has to look at."""
    kept = Path("fuzz-found")
    kept.mkdir(exist_ok=True)
    (kept / f"{len(list(kept.iterdir()))}-{path.name}").write_bytes(path.read_bytes())


@click.command()
@click.option("--minutes", type=float, default=10, show_default=True)
@click.option("--seed", type=int, default=0, show_default=True)
def main(minutes: float, seed: int) -> None:
    """Fuzz the readers for so long, and count what came of each file."""
    counts: Counter[tuple[str, str]] = Counter()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        contents = examples(folder)
        until = time.monotonic() + 60 * minutes
        while time.monotonic() < until:
            seed += 1
            arguments = (folder, contents, seed, until)
            process = get_context("fork").Process(target=read_many, args=arguments)
            process.start()
            process.join()
            for line in (folder / "told").read_text().splitlines():
                kind, _, what = line.partition(" ")
                counts[kind, what or f"DIED with {process.exitcode}"] += 1
                if not what:
                    keep(folder / kind)
    shown = Table("kind of file", "what came of it", "files")
    for (kind, what), number in sorted(counts.items()):
        shown.add_row(kind, what, f"{number:,}")
    Console(width=140).print(shown)
    bad = {what for _, what in counts} - {"read", "refused"}
    click.echo(json.dumps({"files": sum(counts.values()), "other than ours": len(bad)}))
    sys.exit(bool(bad))


if __name__ == "__main__":
    main()
