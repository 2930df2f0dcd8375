"""The files that commands write and read by default."""

from pathlib import Path

RUN = Path("run.h5")
RESULT = Path("score.json")


def existing_run() -> Path | None:
    """The recording that a test without one learns from, if it is there."""
    return RUN if RUN.exists() else None
