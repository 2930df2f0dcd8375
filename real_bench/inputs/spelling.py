"""Text of a certain form in users' files: what does not match is answered with the rule."""

from __future__ import annotations

import re
from typing import Annotated

from pydantic import AfterValidator


def spelled(pattern: str, rule: str) -> AfterValidator:
    """A check of text against a pattern; its error says the rule instead of the pattern."""

    def check(text: str) -> str:
        if not re.fullmatch(pattern, text):
            raise ValueError(rule)
        return text

    return AfterValidator(check)


Sha256 = Annotated[
    str, spelled("[0-9a-f]{64}", "a sha256 has 64 hexadecimal digits, in lower case")
]
