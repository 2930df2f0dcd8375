"""Which packages are installed; all else is in pyproject.toml."""

from setuptools import find_packages, setup

BESIDE = ("controllers", "goals")
"""Folders at the top that are installed as packages of real_bench."""

setup(
    packages=[
        *find_packages(include=["real_bench", "real_bench.*"]),
        *(
            f"real_bench.{found}"
            for folder in BESIDE
            for found in find_packages(include=[folder, f"{folder}.*"])
        ),
    ],
)
