"""Where the robot is at rest."""

HOME = (0.0,) * 9
"""Joint angles (radians): arm straight up, gripper closed; also what "no command" means."""
