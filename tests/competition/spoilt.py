"""Submissions that are spoilt in every way we could think of: each is to be refused, and no more.

Each is made at a place without suffix by a function below, with words that its refusal must have.
"""

from __future__ import annotations

import json
import os
import stat
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tests.competition.five import GOOD, submission

LOCAL_HEADER, DEFLATED = 30, 8
MANIFEST: dict[str, Any] = {
    "name": "Spoilt",
    "authors": ["Somebody"],
    "entry": "controller.py",
    "condition": "OM",
}

Spoil = Callable[[Path], object]


def folder(place: Path, **changes: Any) -> Path:
    return submission(place, GOOD, **changes)


def packed(place: Path, more: dict[str, str] | None = None, method: int = DEFLATED) -> Path:
    """A good archive with some files more."""
    path = place.with_name(f"{place.name}.zip")
    files = {"submission.yaml": json.dumps(MANIFEST), "controller.py": GOOD, **(more or {})}
    with zipfile.ZipFile(path, "w", method) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return path


def damaged(place: Path) -> None:
    path = packed(place)
    content = bytearray(path.read_bytes())
    content[LOCAL_HEADER + len("submission.yaml")] = 0x07  # no such kind of block
    path.write_bytes(content)


def other_content(place: Path) -> None:
    """Its checksum is not that of its content."""
    path = packed(place, method=zipfile.ZIP_STORED)
    path.write_bytes(path.read_bytes().replace(b"at random", b"at Random"))


def truncated(place: Path) -> None:
    path = packed(place)
    path.write_bytes(path.read_bytes()[:-30])


def without_middle(place: Path) -> None:
    path = packed(place)
    content = path.read_bytes()
    path.write_bytes(content[:100] + content[-200:])


def encrypted(place: Path) -> None:
    path = packed(place)
    content = bytearray(path.read_bytes())
    for header, at in ((b"PK\x01\x02", 8), (b"PK\x03\x04", 6)):
        content[content.index(header) + at] |= 1
    path.write_bytes(content)


def bomb(place: Path) -> None:
    """Its directory declares more than may be unpacked."""
    with zipfile.ZipFile(place.with_name(f"{place.name}.zip"), "w") as archive:
        archive.writestr("submission.yaml", json.dumps(MANIFEST))
        archive.filelist[0].file_size = 2**30


def modest_bomb(place: Path) -> None:
    """Its directory declares less than there is."""
    path = packed(place, {"zeros": "0" * 2**24})
    content = bytearray(path.read_bytes())
    at = content.rindex(b"PK\x01\x02")
    content[at + 24 : at + 28] = struct.pack("<I", 10)
    path.write_bytes(content)


def name_not_utf8_in_archive(place: Path) -> None:
    path = packed(place, {"ééé": ""})
    path.write_bytes(path.read_bytes().replace("ééé".encode(), b"\xff" * 6))


def linked_archive(place: Path) -> None:
    with zipfile.ZipFile(place.with_name(f"{place.name}.zip"), "w") as archive:
        archive.writestr("submission.yaml", json.dumps(MANIFEST))
        link = zipfile.ZipInfo("controller.py")
        link.external_attr = (stat.S_IFLNK | 0o777) << 16
        archive.writestr(link, "/etc/passwd")


def many_files(place: Path) -> None:
    data = folder(place) / "data"
    data.mkdir()
    for number in range(10_001):
        (data / str(number)).touch()


def too_large(place: Path) -> None:
    with (folder(place) / "data").open("wb") as file:
        file.truncate(2**30)


def too_deep(place: Path) -> None:
    """Deeper than Python recurses; no longer than a path may be."""
    before = Path.cwd()
    os.chdir(folder(place))
    for _ in range(1200):
        Path("a").mkdir()
        os.chdir("a")
    Path("controller.py").touch()
    os.chdir(before)


def manifest_folder(place: Path) -> None:
    (place / "submission.yaml").mkdir(parents=True)


def manifest_pipe(place: Path) -> None:
    place.mkdir()
    os.mkfifo(place / "submission.yaml")


def manifest_loop(place: Path) -> None:
    place.mkdir()
    (place / "submission.yaml").symlink_to("submission.yaml")


def manifest_link(place: Path) -> None:
    (folder(place) / "submission.yaml").rename(place / "other.yaml")
    (place / "submission.yaml").symlink_to("other.yaml")


def manifest_like_a_result(place: Path) -> None:
    """Taken for a result, it is not handed in."""
    folder(place, description="realbench-result")


def manifest_bytes(place: Path) -> None:
    (folder(place) / "submission.yaml").write_bytes(b"\xff\xfe\x00\x01")


def manifest_nested(place: Path) -> None:
    (folder(place) / "submission.yaml").write_text("[" * 40_000)


def file_not_utf8(place: Path) -> None:
    (folder(place) / os.fsdecode(b"caf\xe9.py")).touch()


def folder_not_utf8(place: Path) -> None:
    inside = folder(place) / os.fsdecode(b"caf\xe9")
    inside.mkdir()
    (inside / "plain.py").touch()


def unreadable_file(place: Path) -> None:
    (folder(place) / "data").touch(mode=0)


def unreadable_folder(place: Path) -> None:
    folder(place).chmod(0)


def wheel_folder(place: Path) -> None:
    wheel = folder(place, requirements=["anything"]) / "wheels" / "anything-1-py3-none-any.whl"
    wheel.mkdir(parents=True)
    (wheel / "inside").touch()


SPOILT: dict[str, tuple[Spoil, str]] = {
    "damaged": (damaged, "cannot be unpacked: "),
    "other_content": (other_content, "cannot be unpacked: Bad CRC"),
    "truncated": (truncated, "cannot be unpacked: "),
    "without_middle": (without_middle, "cannot be unpacked: "),
    "encrypted": (encrypted, "cannot be unpacked: "),
    "no_bytes": (lambda place: place.with_name("no_bytes.zip").touch(), "cannot be unpacked: "),
    "no_files": (
        lambda place: zipfile.ZipFile(place.with_name("no_files.zip"), "w").close(),
        "has no submission.yaml",
    ),
    "lzma": (lambda place: packed(place, method=zipfile.ZIP_LZMA), "(deflate)"),
    "bzip2": (lambda place: packed(place, method=zipfile.ZIP_BZIP2), "(deflate)"),
    "bomb": (bomb, "is too large: 1 file, 1,024 MiB"),
    "modest_bomb": (modest_bomb, "cannot be unpacked: "),
    "name_not_utf8": (name_not_utf8_in_archive, "not UTF-8"),
    "long_name": (lambda place: packed(place, {"a" * 300: ""}), "File name too long"),
    "same_name": (lambda place: packed(place, {"a": "", "a/b": ""}), "of the same name"),
    "twice": (lambda place: packed(place, {"a": "", "./a": ""}), "of the same name"),
    "deep_archive": (lambda place: packed(place, {"a/" * 1500 + "b": ""}), "too many folders"),
    "leads_out": (lambda place: packed(place, {"../../escaped": ""}), "leads out of its folder"),
    "link_in_archive": (linked_archive, "has a link"),
    "many_files": (many_files, "is too large: 10,003 files"),
    "too_large": (too_large, "is too large: 3 files"),
    "too_deep": (too_deep, "too many folders"),
    "no_manifest": (lambda place: place.mkdir(), "has no submission.yaml"),
    "manifest_folder": (manifest_folder, "has no submission.yaml"),
    "manifest_pipe": (manifest_pipe, "has no submission.yaml"),
    "manifest_loop": (manifest_loop, "has no submission.yaml"),
    "manifest_link": (manifest_link, "submission.yaml is a link"),
    "manifest_bytes": (manifest_bytes, "cannot be read"),
    "manifest_nested": (manifest_nested, "recursion"),
    "manifest_result": (manifest_like_a_result, "submission.yaml"),
    "file_not_utf8": (file_not_utf8, "not UTF-8"),
    "folder_not_utf8": (folder_not_utf8, "not UTF-8"),
    "unreadable_file": (unreadable_file, "Permission denied"),
    "unreadable_folder": (unreadable_folder, "Permission denied"),
    "wheel_folder": (wheel_folder, "Is a directory"),
}
