"""What the documentation says is so: its code runs, its commands, files and targets exist."""

from __future__ import annotations

import re
import runpy
import shlex
from pathlib import Path

import click
import pytest

from real_bench.cli import COMMANDS, cli
from real_bench.experiments import read_spec
from tests.cli.shell import realbench
from tests.pages import ROOT, Page, table_of_results

FILES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md"]
FILES += [ROOT / "goals" / "README.md", ROOT / "evaluation" / "README.md"]
FILES += sorted((ROOT / "docs").glob("*.md"))
PAGES = [Page(path) for path in FILES]
DOCS = [page for page in PAGES if page.path.parent.name == "docs"]
named = pytest.mark.parametrize("page", PAGES, ids=[str(p.path.relative_to(ROOT)) for p in PAGES])

OF_OTHERS = ("cluster.md", "official-api.md", "data.md", "gymnasium.md", "tutorial.md")
"""Pages whose Python needs a cluster or the kit of the competition, runs in test_data_pages.py, or
with the page's own commands (test_tutorial_commands_run); that is only compiled here."""


def test_table_of_results_matches_what_its_command_prints() -> None:
    arguments = ("table", "evaluation/paper.yaml", "--format", "markdown")
    assert table_of_results() == realbench(ROOT, *arguments).stdout.strip()


@named
def test_every_file_that_is_named_exists(page: Page) -> None:
    folders = "real_bench|controllers|goals|docs|evaluation"
    files = re.findall(rf"`((?:{folders})/[\w./-]+)`", page.text)
    for path in files:
        if "/smoke/" not in path:
            assert (ROOT / path).exists(), path
    for link in re.findall(r"\]\((?!https?:)([\w./-]+)(?:#[\w-]+)?\)", page.text):
        assert (page.path.parent / link).exists(), link


def test_messages_that_are_explained_exist() -> None:
    page = Page(ROOT / "docs" / "troubleshooting.md")
    messages = re.findall(r"^\| `([^`]+)`", page.text, re.MULTILINE)
    assert len(messages) > 10
    code = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "real_bench").rglob("*.py"))
    code += "".join(path.read_text(encoding="utf-8") for path in ROOT.glob("controllers/*.py"))
    unbroken = re.sub(r'"\s*f?"', "", code)  # a long message is written in parts
    for message in messages:
        assert message in unbroken, message


@named
def test_every_make_target_that_is_named_exists(page: Page) -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    for target in re.findall(r"(?:`|^    )make ([a-z]+)\b", page.text, re.MULTILINE):
        assert f"\n{target}:" in makefile, target


@named
def test_every_command_and_option_exists(page: Page) -> None:
    for command in page.commands():
        words = shlex.split(command.split(" > ")[0], comments=True)[1:]
        if words[0] in ("COMMAND", "--help"):
            continue
        assert words[0] in COMMANDS, command
        found = cli.get_command(click.Context(cli), words[0])
        if isinstance(found, click.Group) and len(words) > 1:
            found = found.get_command(click.Context(found), words[1])
        assert found is not None, command
        known = {opt for p in found.params for opt in (*p.opts, *p.secondary_opts)} | {"--help"}
        for word in words:
            if word.startswith("--"):
                assert word.partition("=")[0] in known, command


@pytest.mark.parametrize(
    ("page", "number"),
    [(page, k) for page in DOCS for k in range(len(page.blocks("python")))],
    ids=lambda value: value.path.name if isinstance(value, Page) else str(value),
)
def test_python_in_a_page_runs(page: Page, number: int, tmp_path: Path) -> None:
    """A block with a title is a controller, which is to do; any other runs as it stands."""
    block = page.blocks("python")[number]
    code = compile(block.text, page.path.name, "exec")
    if page.path.name in OF_OTHERS:
        return
    if not block.title:
        exec(code, {})
        return
    (tmp_path / block.title).write_text(block.text)
    told = realbench(tmp_path, "check", block.title, "--condition", "OM").stdout
    assert "isolated" in told
    play = ("--condition", "OM", "--scene", "builtin", "--steps", "3000", "--out", "run.h5")
    realbench(tmp_path, "intrinsic", "--controller", block.title, *play)
    as_made = () if "use_experience" in block.text else ("--as-made",)
    test = ("--run", "run.h5", "--trials", "1", "--trial-steps", "2000")
    realbench(tmp_path, "extrinsic", *test, *as_made)


def test_experiment_page_shows_a_valid_spec(tmp_path: Path) -> None:
    small = Page(ROOT / "docs" / "experiments.md").blocks("yaml")[0]
    (tmp_path / small.title).write_text(small.text)
    assert [cell.name for cell in read_spec(tmp_path / small.title).cells] == [
        "real_t-OM-1",
        "real_d-OM-1",
    ]


def test_every_key_in_a_table_has_a_meaning() -> None:
    complete = runpy.run_path(str(ROOT / "docs" / "hooks.py"))["on_page_markdown"]
    rows = re.findall(
        r"^\| `.*\|$", complete(Page(ROOT / "docs" / "settings.md").text), re.MULTILINE
    )
    assert len(rows) > 100
    for row in rows:
        assert row.split(" | ")[-1].strip(" |"), row


def test_tutorial_commands_run(tmp_path: Path) -> None:
    """Its commands word for word, but for shorter plays, and fewer and shorter trials."""
    page = Page(ROOT / "docs" / "tutorial.md")
    (tmp_path / "mine.py").write_text(page.blocks("python")[0].text)
    for command in page.commands():
        words = shlex.split(command)[1:]
        if words[0] == "scene" or len(words) == 1:  # installs, or is only named
            continue
        shorter = {"200000": "3000", "10": "2"}
        words = [shorter.get(word, word) for word in words]
        if words[0] == "extrinsic":
            words += ["--trial-steps", "1000"]
        if words[0] == "table" and "--init" not in words:
            cell = page.blocks("yaml")[0].text
            spec = (tmp_path / "mine.yaml").read_text().replace("200000", "3000")
            spec = spec.replace("trial_steps: 10000", "trial_steps: 1000")
            (tmp_path / "mine.yaml").write_text(spec + cell)
        realbench(tmp_path, *words)
    assert (tmp_path / "mine.html").stat().st_size > 10_000
    assert "mine" in realbench(tmp_path, "table", "mine.yaml").stdout
