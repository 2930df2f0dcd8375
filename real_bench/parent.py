"""No process that works for another outlives it."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable


def end_when(parent_is_gone: Callable[[], object]) -> None:
    """End this process as soon as a call returns, which is to wait until the parent is gone."""

    def wait() -> None:
        parent_is_gone()
        os._exit(1)

    threading.Thread(target=wait, daemon=True).start()
