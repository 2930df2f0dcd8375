"""Our own module ``real_robots``, for authors of official controllers to import.

Controllers that realbench loads find it by themselves. For scripts and unit tests outside::

    import real_bench.compat
    real_bench.compat.install()
    import real_robots  # policy.BasePolicy, evaluate, envs.REALRobotEnv, the registered ids
"""

from real_bench.controller_code.official_module import install

__all__ = ["install"]
