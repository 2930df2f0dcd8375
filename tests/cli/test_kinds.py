from __future__ import annotations

from pathlib import Path

import pytest

from real_bench.cli.kinds import kind_of


@pytest.mark.parametrize(
    ("name", "content", "kind"),
    [
        ("run", b"\x89HDF\r\n", "recording"),
        ("goals.npy", b"\x93NUMPY", "goal set"),
        ("score.json", b'{"version": 3}', "result"),
        ("mine.yaml", b"title: mine", "experiment"),
        ("mine.yaml", b'{"title": "mine"}', "experiment"),
    ],
)
def test_files_are_told_by_what_they_hold(
    tmp_path: Path, name: str, content: bytes, kind: str
) -> None:
    (tmp_path / name).write_bytes(content)
    assert kind_of(tmp_path / name) == kind
