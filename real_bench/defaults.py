"""The files that commands write and read where none is named."""

from pathlib import Path

RUN = Path("run.h5")
RESULT = Path("score.json")
