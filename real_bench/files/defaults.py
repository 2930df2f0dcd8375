"""The files that commands write and read by default."""

from pathlib import Path

RUN = Path("run.h5")
RESULT = Path("score.json")
