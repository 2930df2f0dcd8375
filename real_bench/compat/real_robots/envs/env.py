"""The official environment, where goal files look for the class of their goals."""

from real_bench.compat.environment import Goal, REALRobotEnv

__all__ = ["Goal", "REALRobotEnv"]

Goal.__module__ = "real_robots.envs.env"  # a pickle finds its class by this name
