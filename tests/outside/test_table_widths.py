"""Tables of numbers have room in a hundred columns, and no column that says nothing."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.shell import realbench
from tests.pages import ROOT, table_of_results

RESULTS = "evaluation/results/full-scale"


def widest(text: str) -> int:
    return max(map(len, text.splitlines()))


def test_text_table_fits_and_has_every_cell_of_the_markdown_table(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The latter stands in a page, and is what its command prints (test_docs.py)."""
    monkeypatch.setenv("COLUMNS", "100")
    told = realbench(ROOT, "table", "evaluation/paper.yaml").stdout
    assert widest(told) <= 100
    rows = [line for line in table_of_results().splitlines() if line.startswith("| real")]
    assert len(rows) > 10
    for row in rows:
        assert all(cell.strip() in told for cell in row.split("|"))


def test_comparison_fits_into_a_hundred_columns(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "100")
    results = (f"{RESULTS}/real_ld-IM-1-*-a.json", f"{RESULTS}/real_d-OM-1-*-a.json")
    assert widest(realbench(ROOT, "compare", *results).stdout) <= 100


def test_columns_without_values_are_left_out(tmp_path: Path) -> None:
    (tmp_path / "x.yaml").write_text(
        "{scene: builtin, run: false, cells: [{controller: real_r, condition: OM, play: none}],"
        " goals: {few: {seed: 1}}}"
    )
    for form in ("text", "markdown", "latex"):
        told = realbench(tmp_path, "table", "x.yaml", "--format", form).stdout
        for heading in ("published", "difference", "IQM", "2D", "95%"):
            assert heading not in told
        assert "mean" in told
