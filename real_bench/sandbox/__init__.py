"""Controllers in a process of their own, in a sandbox; see docs/security.md."""

from real_bench.sandbox.backend import SandboxBackend
from real_bench.sandbox.limits import Limits
from real_bench.sandbox.support import SandboxSupport, kernel_support, sandbox_support

__all__ = ["Limits", "SandboxBackend", "SandboxSupport", "kernel_support", "sandbox_support"]
