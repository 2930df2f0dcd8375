from __future__ import annotations

import json
import re
import shutil
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from real_bench.competition.site import page_prefix
from tests.cli.shell import realbench
from tests.competition.five import GOOD, rounds, submission

NAMES = st.from_regex(r"[a-z0-9_][a-z0-9_.+-]{0,3}", fullmatch=True)
HOSTILE = "<script>alert('x')</script>&\"'"


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory, goals_file: Path) -> Path:
    """The site of a round with a scored and a refused submission, with films."""
    place = tmp_path_factory.mktemp("site")
    (place / "goals.npy").write_bytes(goals_file.read_bytes())
    hostile = HOSTILE.replace("/", "")
    submission(place / "submissions" / "good", GOOD, name=hostile, description=HOSTILE)
    submission(place / "submissions" / "bad", GOOD, condition="IM", authors=[hostile])
    path = rounds(place, play="none", trial_steps=1000)
    realbench(place, "round", "run", "submissions", path)
    realbench(place, "leaderboard", "results", "--site", "site", "--films")
    return place / "site"


def test_site_has_no_external_links_or_injected_scripts(site: Path) -> None:
    for page in site.glob("*.html"):
        text = page.read_text()
        assert "<script>alert" not in text
        addresses = re.findall(r'(?:src|href)="([^"]*)"', text)
        assert not [each for each in addresses if "//" in each and not each.startswith("data:")]


def test_existing_folder_is_not_overwritten(site: Path, tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    results = site.parent / "results"
    done = realbench(tmp_path, "leaderboard", results, "--site", ".", code=1)
    assert "holds other files" in done.stderr
    done = realbench(tmp_path, "leaderboard", results, "--site", site, code=1)
    assert "use --overwrite" in done.stderr


def test_site_is_kept_until_a_new_one_can_be_made(site: Path, tmp_path: Path) -> None:
    """Here the films need a scene that is gone. A site that was begun can be made again."""
    place = tmp_path / "place"
    shutil.copytree(site.parent, place)
    facts = place / "results" / "first" / "round.json"
    changed = json.loads(facts.read_text()) | {"scene": "nowhere.yaml"}
    facts.write_text(json.dumps(changed))
    options = ["leaderboard", "results", "--films"]
    before = {page.name: page.read_bytes() for page in (place / "site").glob("*.html")}
    assert len(before) == 3
    realbench(place, *options, "--site", "site", "--overwrite", code=1)
    assert {page.name: page.read_bytes() for page in (place / "site").glob("*.html")} == before
    realbench(place, *options, "--site", "new", code=1)
    facts.write_text(json.dumps(changed | {"scene": "builtin"}))
    realbench(place, *options, "--site", "new", "--overwrite")
    assert (place / "new" / "index.html").exists()


@given(names=st.lists(st.tuples(NAMES, NAMES), min_size=2, max_size=2, unique=True))
def test_no_two_submissions_have_the_same_page(names: list[tuple[str, str]]) -> None:
    prefixes = {page_prefix(round_name, key) for round_name, key in names}
    assert len(prefixes) == len(names)


@pytest.mark.parametrize("width", [1200, 390])
def test_browser_shows_the_site(browser: Any, site: Path, width: int) -> None:
    told: list[str] = []
    for name in ("index", "first~good", "first~bad"):
        tab = browser.new_page(viewport={"width": width, "height": 900})
        tab.on("console", lambda message: told.append(message.text))
        tab.on("pageerror", lambda error: told.append(str(error)))
        tab.goto((site / f"{name}.html").as_uri())
        assert tab.evaluate("document.documentElement.scrollWidth") <= width
        if name == "index":
            tab.locator("th button", has_text="status").click()
            statuses = tab.locator('td[data-name="status"]').all_text_contents()
            assert statuses == sorted(statuses)
            tab.locator("td a").first.click()
            assert "first~" in tab.url
        if name == "first~good":
            assert tab.locator("video").count() == 3
            ready = "document.querySelector('video').readyState >= 1"
            tab.evaluate("document.querySelector('video').preload = 'metadata'")
            tab.wait_for_function(f"{ready} || document.querySelector('video').error")
            assert tab.evaluate(ready)
    assert told == []
