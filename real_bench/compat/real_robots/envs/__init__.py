"""The official environment."""

from .env import Goal, REALRobotEnv

__all__ = ["Goal", "REALRobotEnv"]
