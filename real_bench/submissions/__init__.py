"""Submissions: controllers in folders of their own, with ``submission.yaml``."""

from real_bench.submissions.manifest import (
    FROZEN,
    MANIFEST,
    Submission,
    find_submission,
    is_submission,
    read_submission,
)

__all__ = [
    "FROZEN",
    "MANIFEST",
    "Submission",
    "find_submission",
    "is_submission",
    "read_submission",
]
