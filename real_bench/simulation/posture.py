"""The robot's home posture."""

HOME = (0.0,) * 9
"""Joint angles (radians): arm straight up, gripper closed; also what "no command" means."""
