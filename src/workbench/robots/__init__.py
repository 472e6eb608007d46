"""Robots: a folder each, of an MJCF, a robot file and formulas; read, changed and checked here.

What describes a robot to the reference and to campaigns stands in the files of this package; each sub-package is one
robot, and nothing above knows it by name.
"""
