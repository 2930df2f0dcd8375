"""Let child processes end with their parent."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable


def exit_after(wait_for_parent: Callable[[], object]) -> None:
    """End this process once ``wait_for_parent`` returns; the call waits for the parent's end."""

    def wait() -> None:
        wait_for_parent()
        os._exit(1)

    threading.Thread(target=wait, daemon=True).start()
