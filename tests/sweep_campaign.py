"""A small sweep for tests."""

from __future__ import annotations

from small_campaign import HEAD

SWEEP = (
    HEAD.replace('name = "small"', 'name = "sweep"')
    + """
[[candidate]]
name = "distributed"
reference = "distributed"
bound = 1e-9

[[candidate]]
name = "lumped"
reference = "distributed"

[[case]]
name = "variant"
[case.motion]
kind = "sine"
offset = [0.0, 0.75, 0.80]
amplitude = [0.08, 0.22, 0.20]
frequency = [5.0, 10.0, 15.0]
phase = [0.0, 0.0, 1.0]
stop = 1.0
samples = 11

[sweep]
method = "sobol"
samples = 40
seed = 3
time_limit = 20.0
filter = { inside_workspace = true }
[[sweep.vary]]
key = "parameters.a2"
low = 0.8
high = 1.2
relative = true
[[sweep.vary]]
key = "parameters.payload"
low = 0.0
high = 2.0
[[sweep.vary]]
key = "speed"
low = 0.25
high = 2.0
scale = "log"
"""
)
