"""What a submission says of itself, in the file ``submission.yaml`` of its folder."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, ValidationError, field_validator

from real_bench.errors import SubmissionError, faults
from real_bench.fields import ConditionName
from real_bench.inputs.records import Record
from real_bench.inputs.yaml_files import read_mapping
from real_bench.text.nearest import unknown_name_hint

MANIFEST = "submission.yaml"
"""The file by which a folder is a submission."""

FROZEN = "submissions"
"""The folder in a round's results with the submissions as they were handed in."""

WHEELS = "wheels"
"""The folder in a submission with wheels of its requirements; then only these are used."""

_ENTRY = re.compile(r"(?P<file>[A-Za-z_][A-Za-z0-9_]*\.py)(:(?P<name>[A-Za-z_][A-Za-z0-9_]*))?")

Text = Annotated[str, Field(min_length=1, max_length=60)]


class Submission(Record):
    """A submission: a controller in a folder of its own, and what it needs.

    Attributes:
        folder: where it is.
        name: shown in tables and on leaderboards.
        authors: one or more.
        entry: the controller's file, at the top of the folder, with ``:Class`` if it has
            several.
        condition: two letters: what it is made for.
        settings: of the controller, above its defaults.
        requirements: packages it needs besides realbench's, as pip names them: no addresses.
        description: a sentence for the leaderboard's page.
    """

    folder: Path
    name: Text
    authors: Annotated[tuple[Text, ...], Field(min_length=1, max_length=50)]
    entry: str
    condition: ConditionName = "IM"
    settings: dict[str, Any] = Field(default_factory=dict)
    requirements: Annotated[tuple[str, ...], Field(max_length=50)] = ()
    description: Annotated[str, Field(max_length=500)] = ""

    @field_validator("name")
    @classmethod
    def _name_is_plain(cls, name: str) -> str:
        if not name.isprintable() or any(sign in name for sign in ":/\\") or name != name.strip():
            raise ValueError("a name must be printable, without : / and \\")
        return name

    @field_validator("authors", "description")
    @classmethod
    def _is_printable(cls, value: Any) -> Any:
        lines = (value,) if isinstance(value, str) else value
        if not all(line.isprintable() for line in lines):
            raise ValueError("it must be one printable line")
        return value

    @field_validator("entry")
    @classmethod
    def _entry_is_a_file(cls, entry: str) -> str:
        if not _ENTRY.fullmatch(entry):
            raise ValueError("name a file at the top of the folder: controller.py[:Class]")
        return entry

    @field_validator("requirements")
    @classmethod
    def _requirements_are_names(cls, lines: tuple[str, ...]) -> tuple[str, ...]:
        from packaging.requirements import InvalidRequirement, Requirement

        for line in lines:
            try:
                parsed = Requirement(line)
            except InvalidRequirement as error:
                raise ValueError(f"{line!r} is not a requirement like scikit-learn>=1.4") from error
            if parsed.url:
                raise ValueError(f"{line!r}: name a package and its version, not an address")
        return lines

    @property
    def file(self) -> Path:
        """The controller's file."""
        return self.folder / self.entry.partition(":")[0]

    @property
    def class_name(self) -> str:
        """The controller's class; empty if it is the only one."""
        return self.entry.partition(":")[2]

    @property
    def wheels(self) -> list[Path]:
        """The wheels that it brings along."""
        return sorted((self.folder / WHEELS).glob("*.whl"))


def is_submission(folder: Path) -> bool:
    """Whether a folder holds a submission."""
    return (folder / MANIFEST).is_file()


def find_submission(named: str, base: Path = Path()) -> Path | None:
    """The folder of a submission, named by it or as ``folder:name``; None where there is none.

    Args:
        named: as a user names a controller.
        base: what its path is relative to.
    """
    folders = [base / each for each in (named, named.rpartition(":")[0]) if each]
    return next(filter(is_submission, folders), None)


def read_submission(folder: Path) -> Submission:
    """The submission in a folder; raises SubmissionError with every fault at once."""
    path = folder / MANIFEST
    if path.is_symlink():
        raise SubmissionError(f"{path} is a link, which is not allowed")
    values = read_mapping(path, "the file of a submission", SubmissionError)
    if "folder" in values:
        raise SubmissionError(f"{path} is not valid: folder: not allowed here")
    if isinstance(values.get("authors"), str):
        values["authors"] = [values["authors"]]
    try:
        submission = Submission.model_validate({**values, "folder": folder.resolve()})
    except ValidationError as error:
        found = faults(error, unknown=unknown_name_hint(Submission, {"folder"}))
        raise SubmissionError(f"{path} is not valid: {found}") from error
    if not submission.file.is_file() or submission.file.is_symlink():
        raise SubmissionError(f"{path} is not valid: entry: file not found: {submission.entry}")
    return submission
