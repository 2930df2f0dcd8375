"""What the pages about data, watching and Gymnasium show runs as it stands."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.cli.shell import realbench

DOCS = Path(__file__).parents[1] / "docs"
PAGES = ("data", "gymnasium", "watching")


def blocks(page: str) -> list[str]:
    text = (DOCS / f"{page}.md").read_text(encoding="utf-8")
    return re.findall(r"```python\n(.*?)```", text, re.DOTALL)


def commands(page: str) -> list[list[str]]:
    """The commands of realbench in a page, without what a shell adds."""
    text = (DOCS / f"{page}.md").read_text(encoding="utf-8")
    lines = re.findall(r"^    realbench (.*?)\s*(?:&|#.*)?$", text, re.MULTILINE)
    return [line.split() for line in lines]


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
    done = subprocess.run([sys.executable, script], cwd=place, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def indented(code: str) -> str:
    return "".join(f"    {line}" for line in code.splitlines(keepends=True))


def test_the_controller_logs(place: Path) -> None:
    printed = realbench(place, "watch", "run.h5", "--json").stdout
    assert '"length of the push (m)": 0.' in printed


@pytest.mark.parametrize(
    "arguments",
    [one for page in ("watching", "data") for one in commands(page) if one[0] != "intrinsic"],
    ids=" ".join,
)
def test_the_commands_run(place: Path, arguments: list[str]) -> None:
    for library in ("minari", "tensorboard"):
        if library in " ".join(arguments):
            pytest.importorskip(library)
    realbench(place, *arguments)
