"""What the README shows runs as it stands, and is short."""

from __future__ import annotations

import json
import re
from pathlib import Path

import yaml

from tests.cli.shell import realbench
from tests.pages import ROOT, Page

README = Page(ROOT / "README.md")
MOST_WORDS = 700


def test_readme_is_short() -> None:
    assert len(README.text.split()) <= MOST_WORDS


def test_readme_environment_runs() -> None:
    exec(compile(README.blocks("python")[1].text, "README.md", "exec"), {})


def test_readme_commands_play_and_test_its_controller(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(README.blocks("python")[0].text)
    play, test = (README.command(name) for name in ("intrinsic", "extrinsic"))
    realbench(tmp_path, *play.replace("20000", "2000").split()[1:], "--scene", "builtin")
    assert '"triplets": 2' in realbench(tmp_path, "inspect", "mine.h5", "--json").stdout
    realbench(tmp_path, *test.split()[1:], "--trial-steps", "500")
    realbench(tmp_path, *README.command("report").split()[1:])


def test_readme_results_match_the_table() -> None:
    rows = json.loads(realbench(ROOT, "table", "evaluation/paper.yaml", "--json").stdout)["rows"]
    told = {
        row["name"]: (_number(row["summary"]["metrics"]["score"]), row["published"])
        for row in rows
        if row["summary"]
    }
    pattern = r"^\| (real_[\w-]+) \| (\w+) \| (.+?) \| (.+?) \|$"
    shown = re.findall(pattern, README.text, re.MULTILINE)
    assert shown
    for label, condition, ours, published in shown:
        mean, other = told[f"{label}-{condition}-1"]
        assert (ours, published) == (mean, f"{other['mean']:.3f} ± {other['standard_error']:.3f}")


def _number(score: dict[str, float | None]) -> str:
    error = score["standard_error"]
    return f"{score['mean']:.3f}" + ("" if error is None else f" ± {error:.3f}")


def test_citation_matches_the_paper_and_this_version() -> None:
    from real_bench.version import __version__

    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert cited["version"] == __version__
    (paper,) = cited["references"]
    for author in paper["authors"]:
        assert f"{author['given-names']} {author['family-names']}" in README.text
    assert paper["identifiers"][0]["value"] in README.text
