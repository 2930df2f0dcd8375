"""What a user may have meant by an unknown name."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from difflib import get_close_matches
from typing import Any, get_args, get_origin

from pydantic import BaseModel

MIN_SIMILARITY = 0.7
"""How similar two names must be, from 0 to 1."""


def nearest(name: str, known: Iterable[str]) -> str | None:
    """The known name most similar to a name; None if none is similar.

    For dotted names the last part alone may be similar.
    """
    by_word: dict[str, str] = {}
    for each in known:
        by_word.setdefault(each.rpartition(".")[2].lower(), each)
        by_word[each.lower()] = each
    words = [name.lower(), name.rpartition(".")[2].lower()]
    for word in dict.fromkeys(words):
        if found := get_close_matches(word, by_word, 1, MIN_SIMILARITY):
            return by_word[found[0]]
    return None


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """A question to append after an unknown name, if a similar one exists; else nothing."""
    found = nearest(name, known)
    if found == name:  # the names of a file's settings are nested
        return f", write it as {': {'.join(name.split('.'))}: ...{'}' * name.count('.')}"
    return f", did you mean {found}?" if found else ""


def unknown_name_hint(
    kind: type[BaseModel], without: Collection[str] = ()
) -> Callable[[tuple[int | str, ...]], str]:
    """A function that, for an unknown name in a tree of records, lists the valid names.

    Args:
        kind: the outermost record.
        without: fields of it that users do not give.
    """

    def hint(place: tuple[int | str, ...]) -> str:
        known = _names_at(kind, place)
        if len(place) == 1:
            known = [name for name in known if name not in without]
        return f"{did_you_mean(str(place[-1]), known)} (use: {', '.join(known)})"

    return hint


def _names_at(kind: Any, place: tuple[int | str, ...]) -> list[str]:
    """The fields of the record that a place is in; none if it is in no record."""
    if get_origin(kind) is None and isinstance(kind, type) and issubclass(kind, BaseModel):
        if len(place) == 1:
            return list(kind.model_fields)
        field = kind.model_fields.get(str(place[0]))
        return [] if field is None else _names_at(field.annotation, place[1:])
    for part in get_args(kind):  # a number, a key or a name of a member may lead to it
        for rest in (place, place[1:]):
            if rest and (found := _names_at(part, rest)):
                return found
    return []
