"""Small closed chains for tests, each with the campaign keys that describe it."""

from __future__ import annotations

HEAD = '<mujoco><compiler angle="radian"/><option><flag contact="disable"/></option>'

FOURBAR = f"""{HEAD}
<worldbody>
 <site name="ground" pos="0.5 0 0"/>
 <body name="crank"><joint name="crank" axis="0 -1 0"/>
  <geom type="capsule" fromto="0 0 0 0.15 0 0" size=".01" mass="0.3"/>
  <body name="coupler" pos="0.15 0 0"><joint name="elbow" axis="0 -1 0"/>
   <geom type="capsule" fromto="0 0 0 0.45 0 0" size=".01" mass="0.8"/><site name="coupler" pos="0.2 0 0.05"/>
   <body name="rocker" pos="0.45 0 0"><joint name="wrist" axis="0 -1 0"/>
    <geom type="capsule" fromto="0 0 0 0.3 0 0" size=".01" mass="0.5"/><site name="tip" pos="0.3 0 0"/>
   </body>
  </body>
 </body>
</worldbody>
<equality><connect name="loop" site1="tip" site2="ground"/></equality></mujoco>
"""

PARALLELOGRAM = f"""{HEAD}
<worldbody>
 <body name="left"><joint name="left" axis="0 -1 0"/>
  <geom type="capsule" fromto="0 0 0 0.2 0 0" size=".01" mass="0.3"/>
  <body name="coupler" pos="0.2 0 0"><joint name="hinge" axis="0 -1 0"/>
   <geom type="capsule" fromto="0 0 0 0.5 0 0" size=".01" mass="0.8"/>
   <site name="coupler" pos="0.2 0 0.05"/><site name="end" pos="0.5 0 0"/>
  </body>
 </body>
 <body name="right" pos="0.5 0 0"><joint name="right" axis="0 -1 0"/>
  <geom type="capsule" fromto="0 0 0 0.2 0 0" size=".01" mass="0.3"/><site name="tip" pos="0.2 0 0"/></body>
</worldbody>
<equality><connect name="loop" site1="tip" site2="end"/></equality></mujoco>
"""

CAMPAIGN = """
name = "own"
title = "A four-bar"
model = "fourbar.xml"
actuated = ["crank"]
platform_site = "coupler"
initial = { crank = 1.0, elbow = -0.5, wrist = -1.5 }

[read]
m1 = "mass crank"
a1 = "offset coupler x"
g = "gravity"

[[case]]
name = "turn"
[case.motion]
kind = "sine"
offset = [1.0]
amplitude = [0.6]
frequency = [3.0]
stop = 1.0
samples = 41
"""
