"""Pages of documentation: their blocks of code, and the commands in these."""

from __future__ import annotations

import re
import textwrap
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
FENCED = re.compile(
    r"^( *)```(\w*)(?: title=\"([^\"]*)\")?\n(.*?)^\1```$", re.DOTALL | re.MULTILINE
)
INDENTED = re.compile(r"(?:^ {4,}\S.*\n(?:\n(?= {4}\S))?)+", re.MULTILINE)
COMMAND = re.compile(r"(?:^|run: |`|&& )(realbench [a-z][^`\n]*)", re.MULTILINE)


@dataclass(frozen=True)
class Block:
    """A fenced block: its language, its title (a file's name) and what is in it."""

    language: str
    title: str
    text: str


class Page:
    """A page in Markdown."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.text = path.read_text(encoding="utf-8")

    def blocks(self, language: str) -> list[Block]:
        """The fenced blocks in a language."""
        found = [
            Block(kind, title, re.sub(f"^{margin}", "", text, flags=re.MULTILINE))
            for margin, kind, title, text in FENCED.findall(self.text)
        ]
        return [block for block in found if block.language == language]

    def commands(self) -> list[str]:
        """Every realbench command of the page, comments left out."""
        code = [textwrap.dedent(block) for block in INDENTED.findall(FENCED.sub("", self.text))]
        code += [textwrap.dedent(text) for *_, text in FENCED.findall(self.text)]
        code += re.findall(r"`realbench [^`]+`", " ".join(self.text.split()))
        whole = "\n".join(code).replace("\\\n", " ").replace(">-\n", "")
        found = [re.sub(r"\s+#.*", "", command).strip() for command in COMMAND.findall(whole)]
        return list(dict.fromkeys(found))

    def command(self, name: str) -> str:
        """The first command of a name."""
        return next(each for each in self.commands() if each.startswith(f"realbench {name} "))


def table_of_results() -> str:
    """The table in the page of results, in Markdown."""
    text = Page(ROOT / "docs" / "results.md").text
    shown = re.search(r"<!-- table -->\n(.*?)\n<!-- end of table -->", text, re.DOTALL)
    assert shown is not None
    return shown[1].strip()
