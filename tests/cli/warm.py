"""Imported once by the server of forks that run commands: what each of them would do first."""

from real_bench.physics import fingerprint

fingerprint()
