"""What the pages about data, watching and Gymnasium show runs as it stands."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from real_bench.exporting.minari import MIN_VERSION
from tests.cli.shell import realbench
from tests.pages import ROOT, Page

PAGES = {name: Page(ROOT / "docs" / f"{name}.md") for name in ("data", "gymnasium", "watching")}


def blocks(page: str) -> list[str]:
    return [block.text for block in PAGES[page].blocks("python")]


def commands(page: str) -> list[list[str]]:
    """What the page does with a recording that is there."""
    words = [shlex.split(command)[1:] for command in PAGES[page].commands()]
    return [one for one in words if "run.h5" in one and one[0] != "intrinsic"]


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of 22 actions with images, by the controller of the page about watching."""
    folder = tmp_path_factory.mktemp("pages")
    (folder / "mine.py").write_text(blocks("watching")[0])
    realbench(folder, "intrinsic", "--controller", "mine.py", "--condition", "OM", "--images",
              "--scene", "builtin", "--steps", "22000")  # fmt: skip
    return folder


@pytest.mark.parametrize(
    ("page", "number"), [(page, n) for page in PAGES for n in range(len(blocks(page)))]
)
def test_the_code_runs(place: Path, page: str, number: int) -> None:
    for library in ("stable_baselines3", "pandas"):
        if library in blocks(page)[number]:
            pytest.importorskip(library)
    script = place / f"{page}-{number}.py"
    script.write_text(blocks(page)[number] + "\n")
    if "vectorization_mode" in script.read_text():
        script.write_text("if __name__ == '__main__':\n" + indented(script.read_text()))
    own = {**os.environ, "TMPDIR": str(place)}  # where Stable-Baselines3 leaves its logs
    command = [sys.executable, str(script)]
    done = subprocess.run(command, cwd=place, env=own, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def indented(code: str) -> str:
    return "".join(f"    {line}" for line in code.splitlines(keepends=True))


def test_the_controller_logs(place: Path) -> None:
    printed = realbench(place, "watch", "run.h5", "--json").stdout
    assert '"length of the push (m)": 0.' in printed


@pytest.mark.parametrize(
    "arguments",
    [one for page in ("watching", "data") for one in commands(page)],
    ids=" ".join,
)
def test_the_commands_run(place: Path, arguments: list[str]) -> None:
    for library, lowest in (("minari", MIN_VERSION), ("tensorboard", None)):
        if library in " ".join(arguments):
            pytest.importorskip(library, minversion=lowest)
    realbench(place, *arguments)
