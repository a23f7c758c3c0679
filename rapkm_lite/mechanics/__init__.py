"""Kinematics, dynamics and actuation of the closed chain, and desired motions: (1)-(11), (13)-(15), (17), (21)-(27)."""
