"""The process of an isolated controller: started, listened to, and ended reliably."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import tempfile
import threading
from contextlib import ExitStack, suppress
from typing import IO

from real_bench.errors import (
    BrokenRuleError,
    ControllerError,
    ControllerFailedError,
    ControllerStoppedError,
    OutOfMemoryError,
    RealBenchError,
)
from real_bench.files.locks import temporary_folder
from real_bench.sandbox.channel import Channel
from real_bench.sandbox.faults import is_out_of_memory
from real_bench.sandbox.limits import Limits
from real_bench.sandbox.support import SandboxSupport, Site, bubblewrap_options, python_command
from real_bench.sandbox.visible_files import VisibleFiles
from real_bench.text.quoting import printable
from real_bench.text.signal_names import signal_name

OUTPUT_BYTES = 1 << 20
KEPT_VARIABLES = (
    "LANG",
    "LC_ALL",
    "TZ",
    "OMP_NUM_THREADS",  # the number of threads decides how sums are split
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
)
TIMEOUT_S = 5.0
ASKING_TO_STOP = (signal.SIGTERM, signal.SIGHUP, signal.SIGINT)
"""Whoever ends a job's processes sends one of these to all of them."""


class Process:
    """A child process; nothing of it is left after :meth:`close`."""

    def __init__(self, support: SandboxSupport, visible: VisibleFiles, limits: Limits) -> None:
        self._support = support
        self._is_closed = False
        with ExitStack() as resources:
            folder = resources.enter_context(temporary_folder("realbench-proxy-"))
            ours, theirs = socket.socketpair()
            with ours, theirs:
                site = Site(folder, theirs.fileno())
                self.inbox = site.inbox
                site.inbox.mkdir()
                site.tmp.mkdir()
                self._child = _start(support, visible, limits, site)
                self.channel = Channel(ours.dup())
            self._resources = resources.pop_all()
        self._output = _Output(self._child.stdout)

    def close(self) -> None:
        """Kill it and everything it started; may be called again."""
        if not self._is_closed:  # later the number may be another process group's
            with suppress(OSError, ValueError):
                os.killpg(self._child.pid, signal.SIGKILL)
        self._is_closed = True
        self._child.wait()
        self._output.join()
        self.channel.close()
        self._resources.close()

    def exit_reason(self) -> tuple[type[ControllerError], str]:
        """Why it ended, once its end of the channel is closed: kind of error, and a sentence."""
        try:
            code = self._child.wait(TIMEOUT_S)
        except subprocess.TimeoutExpired:
            return BrokenRuleError, "its process closed the channel to the benchmark"
        self._output.join()
        last_output = self._output.last_line
        how = f"killed by {signal_name(-code)}" if code < 0 else f"with exit code {code}"
        if self._support.bubblewrap and code - 128 in set(signal.Signals):
            how += f", or killed by {signal_name(code - 128)}"  # as shells report signals
        reason = f"its process ended {how}" + (
            f" (its last output: {last_output})" if last_output else ""
        )
        if -code in ASKING_TO_STOP or (self._support.bubblewrap and code - 128 in ASKING_TO_STOP):
            return ControllerStoppedError, reason
        return (
            OutOfMemoryError if is_out_of_memory(last_output) else ControllerFailedError
        ), reason


class _Output:
    """Passes on what a child prints as plain text, up to a limit."""

    def __init__(self, stream: IO[bytes] | None) -> None:
        self._stream = stream
        self._left = OUTPUT_BYTES
        self._end = b""
        self._thread = threading.Thread(target=self._pass_on, daemon=True)
        self._thread.start()

    @property
    def last_line(self) -> str:
        """The last line that is not empty."""
        text = printable(self._end.decode(errors="replace"))
        lines = [line for line in text.splitlines() if line.strip()]
        return lines[-1].strip()[:300] if lines else ""

    def join(self) -> None:
        """Wait until everything printed is passed on."""
        self._thread.join(TIMEOUT_S)

    def _pass_on(self) -> None:
        if self._stream is None:
            return
        with self._stream as stream:
            while piece := os.read(stream.fileno(), 1 << 16):
                self._end = (self._end + piece)[-4096:]
                if self._left <= 0:  # it must still be read, or the child would block
                    continue
                shown, self._left = piece[: self._left], self._left - len(piece)
                _show(printable(shown.decode(errors="replace")))
                if self._left <= 0:
                    _show(f"\n(it printed {OUTPUT_BYTES} bytes: the rest is not shown)\n")


def _show(text: str) -> None:
    with suppress(OSError, ValueError):
        sys.stderr.write(text)
        sys.stderr.flush()


def _start(
    support: SandboxSupport, visible: VisibleFiles, limits: Limits, site: Site
) -> subprocess.Popen[bytes]:
    command = python_command(support, visible, limits, site)
    inherited = [site.channel]
    with tempfile.TemporaryFile() as options:
        if support.bubblewrap:
            # In a file, since a sandboxed process can read its sandbox's command line.
            options.write(os.fsencode("\0".join(bubblewrap_options(visible, site))))
            options.seek(0)
            inherited.append(options.fileno())
            command = [support.bubblewrap, "--args", str(options.fileno()), "--", *command]
        try:
            return subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                pass_fds=inherited,
                env=_environment(support, site),
                cwd="/" if support.bubblewrap else site.tmp,
                start_new_session=True,
            )
        except OSError as error:
            raise RealBenchError(f"cannot start a process for the controller: {error}") from error


def _environment(support: SandboxSupport, site: Site) -> dict[str, str]:
    tmp = "/tmp" if support.bubblewrap else str(site.tmp)
    kept = {name: os.environ[name] for name in KEPT_VARIABLES if name in os.environ}
    return {"PATH": "/usr/bin:/bin", "HOME": tmp, "TMPDIR": tmp, **kept}
