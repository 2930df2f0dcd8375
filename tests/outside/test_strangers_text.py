"""Whatever text comes from outside, wherever it is shown: it is shown, and never obeyed."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path

import pytest
from markdown_it import MarkdownIt
from tabulate import LATEX_ESCAPE_RULES

from real_bench.cli.describing import print_facts
from real_bench.cli.printing import print_tables, say
from real_bench.competition.leaderboard import Leaderboard
from real_bench.competition.leaderboard import markdown_table as leaderboard_markdown
from real_bench.competition.leaderboard import text_table as leaderboard_text
from real_bench.competition.ranking import Row as Ranked
from real_bench.competition.round_file import RoundFacts
from real_bench.competition.standing import Standing
from real_bench.errors import ControllerFailedError
from real_bench.experiments import Spec
from real_bench.experiments.scores import Row
from real_bench.experiments.table import latex_table, markdown_table, text_table
from real_bench.progress.display import ProgressDisplay
from real_bench.report import Report, Table
from real_bench.report.page import render
from real_bench.scoring import verdict as verdicts
from real_bench.scoring.result import Result
from tests.outside.bench import command
from tests.scoring.bench import made

TEXTS = {
    "html": "</p><h2>passed</h2><script>alert(1)</script>",
    "entity": "&lt;b&gt; &amp; &copy;",
    "picture": "![](https://x.example/spy.png)",
    "link": "[all is well](https://x.example) <https://x.example> https://x.example www.x.example",
    "marks": "`code` *b* _i_ __b__ ~~s~~ **b**",
    "row": "a | b |\n| - | - |\n| c | d |",
    "heading": "x\n# passed\n===\n---",
    "list": "- a\n- b",
    "number": "1. a",
    "quote": "> a",
    "fence": "```\ncode",
    "mention": "@everyone #1 $x$",
    "rich": "[bold red]x[/bold red] [/nope] :smile:",
    "cursor": "\x1b[2J\x1b]0;title\x07\x08\r",
    "right to left": "\u202egnp.exe",
    "surrogate": "caf\udce9",
    "xml": "]]> <!-- \x00 \ufffe",
    "percent": "%s {0} {task} \\textbf{x} \\input{x}",
}


def shown(text: str) -> str:
    """A text as it may be shown: what cannot be printed as question marks, spaces as they come."""
    marks = "".join(letter if letter.isprintable() or letter == "\n" else "?" for letter in text)
    return re.sub(r"[\s?]+", "", marks)


def letters(text: str) -> str:
    return re.sub(r"[\s?]+", "", text)


def spec_of(text: str) -> Spec:
    cell = {"controller": "real_r", "condition": "OM", "note": text}
    return Spec.model_validate(
        {"folder": Path(), "title": text, "results": Path("r"), "cells": [cell]}
    )


def rows_of(spec: Spec) -> list[Row]:
    return [Row(spec.cells[0], 1, (), (), None, None)]


def facts(text: str) -> None:
    print_facts({"controller": text, "settings": {text: [text]}, "names": [text]})


def table(text: str) -> None:
    spec = spec_of(text)
    print_tables(text_table(spec, rows_of(spec)))


def board_of(text: str) -> Leaderboard:
    """A leaderboard of a submission that calls itself so, and failed so."""
    facts = RoundFacts(
        **{"title": "t", "name": "first", "condition": "OM", "objects": 1, "scene": "builtin"},
        **{"play": "own", "steps": 1, "trial_steps": 1, "repeats": 1, "limits": {}},
        **{"failure": "zero", "ties": "none", "goals": "", "goals_sha256": "", "n_goals": 1},
        hidden=False,
        commitment="",
    )
    standing = Standing(
        **{"key": "a", "name": "n", "authors": (), "description": "", "sha256": "1"},
        date="",
        status="crashed",
        detail=text,
    )
    return Leaderboard(facts, (Ranked(standing, Path()),))


def leaderboard(text: str) -> None:
    print_tables(leaderboard_text(board_of(text)))


def progress(text: str) -> None:
    with ProgressDisplay(f"playing {text}", "steps", 10) as display:
        display._last_line = -1e9
        display.update(5, text)


TERMINAL: dict[str, Callable[[str], None]] = {
    "line": say,
    "facts": facts,
    "table": table,
    "progress": progress,
    "leaderboard": leaderboard,
}


@pytest.mark.parametrize("name", TEXTS)
@pytest.mark.parametrize("place", TERMINAL)
def test_terminal_shows_text_without_control_characters(
    place: str, name: str, capfd: pytest.CaptureFixture[str]
) -> None:
    TERMINAL[place](TEXTS[name])
    printed = "".join(capfd.readouterr())
    assert all(letter.isprintable() or letter in "\n\t" for letter in printed)
    assert shown(TEXTS[name]) in letters(printed)


@pytest.mark.parametrize("name", TEXTS)
def test_error_line_shows_text_without_control_characters(
    name: str, capfd: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a controller that raises."""
    monkeypatch.chdir(tmp_path)
    raises = f"raise ValueError({TEXTS[name]!r})"
    Path("c.py").write_text(
        "from real_robots.policy import BasePolicy\n"
        f"class C(BasePolicy):\n    def __init__(self, *a): {raises}\n    def step(self, *a): 0\n"
    )
    play = ("--scene", "builtin", "--condition", "OM", "--steps", "100")
    done = command(capfd, "intrinsic", "--controller", "c.py", *play)
    assert done.code == 4
    assert done.err.count("\n") == 1
    assert done.err[:-1].isprintable()
    assert shown(TEXTS[name]) in letters(done.err)


class _Words(HTMLParser):
    """The tags and the text of a page."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.text = ""
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: object) -> None:
        self.tags.append(tag)

    def handle_data(self, data: str) -> None:
        self.text += data


def failed(text: str) -> str:
    return verdicts.failure(text, ControllerFailedError(text), 0.0)[0]


def tabled(text: str) -> str:
    spec = spec_of(text)
    return markdown_table(spec, rows_of(spec))


def judged(text: str) -> str:
    """A result whose controller is called so, as far as a result can hold it."""
    result = made([0.1, 0.2, 0.3, 0.4])
    name = "".join(letter for letter in text if letter.isprintable())
    setting = result.setting.model_copy(update={"controller": name, "scene": name})
    judged_ = verdicts.judge([Result(setting=setting, trials=result.trials)])
    return verdicts.markdown(judged_)


def ranked(text: str) -> str:
    return leaderboard_markdown(board_of(text))


MARKDOWN = {"failure": failed, "table": tabled, "verdict": judged, "leaderboard": ranked}


@pytest.mark.parametrize("name", TEXTS)
@pytest.mark.parametrize("place", MARKDOWN)
def test_markdown_shows_text_as_plain_text(place: str, name: str) -> None:
    """As a real renderer shows it: no element but those that a plain name has, and the text."""
    renderer = MarkdownIt("commonmark").enable(["table", "strikethrough"])
    found = _Words(renderer.render(MARKDOWN[place](TEXTS[name])))
    plain = _Words(renderer.render(MARKDOWN[place]("plain")))
    assert found.tags == plain.tags
    words = TEXTS[name]
    if place == "verdict":
        words = "".join(letter for letter in words if letter.isprintable())
    if place == "verdict" and ":" in words:  # of a file and its class, the class is shown
        words = words.rpartition(":")[2] if words.count(":") == 1 else ""
    assert shown(words) in letters(found.text)


@pytest.mark.parametrize("name", TEXTS)
def test_markdown_turns_nothing_into_a_link(name: str) -> None:
    """What GitHub makes links of, without any mark."""
    page = failed(TEXTS[name])
    assert not re.search(r"https?://|(?<!\\)www\.|(?<!\\)@|(?<!\\)\$", page)


@pytest.mark.parametrize("name", TEXTS)
def test_html_shows_text_as_plain_text(name: str) -> None:
    def page(text: str) -> _Words:
        told = Table(text, (text,), ((text,),), (text,), text)
        return _Words(render(Report(text, [told], remarks=[text])))

    assert page(TEXTS[name]).tags == page("plain").tags
    assert shown(TEXTS[name]) in letters(page(TEXTS[name]).text)


@pytest.mark.parametrize("name", TEXTS)
def test_junit_shows_text_as_plain_text(name: str) -> None:
    _, cases = verdicts.failure(TEXTS[name], ControllerFailedError(TEXTS[name]), 0.0)
    root = ET.fromstring(cases.tostring())
    tags = sorted(element.tag for element in root.iter())
    assert tags == ["error", "system-out", "testcase", "testsuite", "testsuites"]
    failure = root.find(".//error")
    assert failure is not None
    assert shown(TEXTS[name]) in letters(failure.get("message", ""))


@pytest.mark.parametrize("name", TEXTS)
def test_latex_shows_notes_as_plain_text(name: str) -> None:
    """The title is a comment; a line of a note must not become a line of the table."""
    spec = spec_of(TEXTS[name])
    lines = latex_table(spec, rows_of(spec)).splitlines()
    assert lines[0].startswith("% ")
    assert lines[1].startswith(r"\begin{tabular}")
    notes = lines[lines.index(r"\end{tabular}") + 3 :]
    plain = "".join(notes).removesuffix(r"\par}")
    for rule in (*LATEX_ESCAPE_RULES.values(), "\\ensuremath", "\\textbackslash"):
        plain = plain.replace(rule, "")
    assert not set(plain) & set("&%$#_{}~^\\<>")
    assert len(lines) == len(latex_table(spec_of("plain"), rows_of(spec_of("plain"))).splitlines())
