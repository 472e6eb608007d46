"""Robots to look at: MuJoCo's interactive viewer, and pictures and films drawn offscreen."""
