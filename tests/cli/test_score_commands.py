from __future__ import annotations

import json
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

from tests.cli.shell import realbench
from tests.scoring.test_comparison import made


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "near").mkdir()
    for seed in (0, 1):
        made([0.05, 0.06, 0.07, 0.08], seed).save(tmp_path / "near" / f"seed{seed}.json")
    made([0.3, 0.3, 0.3, 0.3]).save(tmp_path / "far.json")
    return tmp_path


@pytest.mark.parametrize("near", ["near", "near/*.json", "near/seed?.json"])
def test_compare_takes_files_folders_and_patterns(folder: Path, near: str) -> None:
    told = json.loads(realbench(folder, "compare", near, "far.json", "--json").stdout)
    assert told["n_repeats"] == [2, 1]
    assert told["improvement"] == 1.0
    assert len(told["goals"]) == 4
    page = realbench(folder, "compare", near, "far.json").stdout
    assert "A scores more on a goal with probability 1.00" in page


def test_score_passes_and_fails_by_its_exit_code(folder: Path) -> None:
    realbench(folder, "score", "near", "--min", "0.3", "--baseline", "far.json")
    failed = realbench(folder, "score", "far.json", "--min", "0.3", code=3)
    assert "not passed: minimum: 0.0156, at least 0.3 is asked" in failed.stderr
    done = realbench(folder, "score", "far.json", "--baseline", "near/seed0.json", code=3)
    assert "not worse than the baseline" in done.stderr


def test_score_writes_what_ci_shows(folder: Path) -> None:
    (folder / "summary.md").write_text("# Before\n")
    files = ("--markdown", "summary.md", "--junit", "junit.xml")
    told = json.loads(realbench(folder, "score", "near", *files, "--json").stdout)
    assert told["passed"] is True
    page = (folder / "summary.md").read_text()
    assert page.startswith("# Before\n## REAL-R passed")
    root = ElementTree.parse(folder / "junit.xml").getroot()
    assert [case.get("name") for case in root.iter("testcase")] == ["complete"]
    again = realbench(folder, "score", "near", *files, code=1)
    assert "junit.xml exists" in again.stderr
    realbench(folder, "score", "near", *files, "--overwrite")


@pytest.mark.parametrize(
    ("named", "told"),
    [("no.json", "does not exist"), ("none/*.json", "no result in"), (".", "no result in")],
)
def test_nothing_to_read_is_told(tmp_path: Path, named: str, told: str) -> None:
    assert told in realbench(tmp_path, "score", named, code=1).stderr
    assert told in realbench(tmp_path, "compare", named, named, code=1).stderr
