"""Let child processes end with their parent."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable


def end_when(parent_is_gone: Callable[[], object]) -> None:
    """End this process once ``parent_is_gone`` returns; the call waits for the parent's end."""

    def wait() -> None:
        parent_is_gone()
        os._exit(1)

    threading.Thread(target=wait, daemon=True).start()
