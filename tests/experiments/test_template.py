"""What `realbench table --init` writes is an experiment that runs and shows every key."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from real_bench.experiments import Spec, read_spec
from real_bench.experiments.spec import TEMPLATE, Cell, DrawnGoals, Play, Published
from tests.cli.shell import realbench


def test_template_is_written_once_and_valid(tmp_path: Path) -> None:
    done = realbench(tmp_path, "table", "mine.yaml", "--init")
    assert "realbench table mine.yaml" in done.stdout
    kept = (tmp_path / "mine.yaml").read_bytes()
    assert [cell.name for cell in read_spec(tmp_path / "mine.yaml").cells] == [
        "real_r-OM-1",
        "real_d-OM-1",
    ]
    assert "exists" in realbench(tmp_path, "table", "mine.yaml", "--init", code=1).stderr
    assert (tmp_path / "mine.yaml").read_bytes() == kept


def test_table_of_the_template_runs(tmp_path: Path) -> None:
    realbench(tmp_path, "table", "mine.yaml", "--init")
    path = tmp_path / "mine.yaml"
    shorter = path.read_text().replace("200000", "4000").replace("10000", "1000")
    path.write_text(shorter.replace("6, 2.5D: 3, 3D: 1", "1, 2.5D: 0, 3D: 0"))
    table = realbench(tmp_path, "table", "mine.yaml").stdout
    assert "real_d" in table
    assert "2 of 2" in table


@pytest.mark.parametrize("record", [Spec, Play, Cell, DrawnGoals, Published])
def test_template_shows_every_key(
    record: type[Spec | Play | Cell | DrawnGoals | Published],
) -> None:
    text = TEMPLATE.read_text()
    for key in set(record.model_fields) - {"folder"}:
        assert re.search(rf"(^|[ {{]){key}: ", text, re.MULTILINE) or f"{key}:" in text, key


def test_commented_out_keys_are_valid_too(tmp_path: Path) -> None:
    text = re.sub(r"^(\s*)# (\w+: )", r"\1\2", TEMPLATE.read_text(), flags=re.MULTILINE)
    (tmp_path / "whole.yaml").write_text(text)
    spec = read_spec(tmp_path / "whole.yaml")
    assert (spec.cells[1].name, spec.cells[1].repeats) == ("real_d-deep-OM-1", 5)
    assert list(spec.goals) == ["few", "shipped", "mine"]
