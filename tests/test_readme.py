"""What the README shows runs as it stands."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from real_bench.cli import COMMANDS
from tests.cli.shell import realbench

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
PYTHON_BLOCKS = re.findall(r"```python\n(.*?)```", README, re.DOTALL)


def test_the_python_example_runs() -> None:
    exec(compile(PYTHON_BLOCKS[0], "README.md", "exec"), {})


def test_the_controller_to_begin_with_plays(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(PYTHON_BLOCKS[1])
    command = re.search(r"realbench (intrinsic --controller mine\.py .*)", README)
    assert command is not None
    arguments = command[1].replace("20000", "2000").split()
    realbench(tmp_path, *arguments, "--scene", "builtin")
    assert '"triplets": 2' in realbench(tmp_path, "inspect", "mine.h5", "--json").stdout


def test_the_table_of_results_is_what_its_command_prints() -> None:
    shown = re.search(r"<!-- table -->\n(.*?)\n<!-- end of table -->", README, re.DOTALL)
    assert shown is not None
    arguments = ("table", "evaluation/paper.yaml", "--format", "markdown")
    assert shown[1].strip() == realbench(ROOT, *arguments).stdout.strip()


@pytest.mark.parametrize("document", ["README.md", "goals/README.md"])
def test_every_file_that_is_named_exists(document: str) -> None:
    text = (ROOT / document).read_text(encoding="utf-8")
    named = re.findall(r"`((?:real_bench|controllers|goals|docs|evaluation)/[\w./-]+)`", text)
    links = re.findall(r"\]\(([\w./-]+)\)", text)
    assert named or links
    for path in [*named, *links]:
        assert (ROOT / path).exists(), path


def test_every_command_that_is_named_exists() -> None:
    for command in re.findall(r"(?:`|^    )realbench ([a-z]+)", README, re.MULTILINE):
        assert command in COMMANDS


def test_every_make_target_that_is_named_exists() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    for target in re.findall(r"(?:`|^    )make ([a-z]+)", README, re.MULTILINE):
        assert f"\n{target}:" in makefile
