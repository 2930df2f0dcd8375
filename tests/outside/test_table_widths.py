"""Tables of numbers have room in a hundred columns, and no column that says nothing."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.shell import realbench

ROOT = Path(__file__).parents[2]
RESULTS = "evaluation/results/full-scale"


@pytest.mark.parametrize(
    "command",
    [
        ("table", "evaluation/paper.yaml"),
        ("compare", f"{RESULTS}/real_ld-IM-1-*-a.json", f"{RESULTS}/real_d-OM-1-*-a.json"),
    ],
)
def test_tables_fit_into_a_hundred_columns(
    command: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "100")
    lines = realbench(ROOT, *command).stdout.splitlines()
    assert max(map(len, lines)) <= 100


def test_text_table_has_every_cell_of_the_markdown_table(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "100")
    table = ("table", "evaluation/paper.yaml")
    told = realbench(ROOT, *table).stdout
    page = realbench(ROOT, *table, "--format", "markdown").stdout
    for line in page.splitlines():
        if line.startswith("| real"):
            assert all(cell.strip() in told for cell in line.split("|"))


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
