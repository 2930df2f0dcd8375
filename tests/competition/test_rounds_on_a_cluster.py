from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.cli.shell import realbench
from tests.competition.five import CRASHING, GOOD, derived, rounds, submission
from tests.experiments.test_cluster import DaskCluster


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[DaskCluster]:
    folder = tmp_path / "cluster"
    folder.mkdir()
    with ExitStack() as stack:
        yield DaskCluster(folder, stack)


def test_round_on_a_cluster_gives_the_same_statuses(place: Path, cluster: DaskCluster) -> None:
    """Whose fault a failure is survives the way back from another process."""
    submission(place / "submissions" / "good", GOOD)
    crashing = derived(CRASHING)
    submission(place / "submissions" / "crashing", crashing, entry="controller.py:Crashing")
    submission(place / "submissions" / "missing", "import nobody_has_it\n" + GOOD)
    cluster.add_workers(1)
    path = rounds(place, play="none", trial_steps=800)
    realbench(place, "round", "run", "submissions", path, "--scheduler", cluster.address)
    told = realbench(place, "leaderboard", "results", "--format", "json").stdout
    found = {row["key"]: row["status"] for row in json.loads(told)["first"]["rows"]}
    assert found == {"good": "scored", "crashing": "crashed", "missing": "refused"}
