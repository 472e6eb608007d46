"""A slider-crank for tests, a robot folder from scratch: MJCF, robot file, right formula and campaign."""

from __future__ import annotations

from pathlib import Path

MODEL = """\
<mujoco model="slider">
 <compiler angle="radian"/>
 <option gravity="0 0 -9.81"/>
 <worldbody>
  <!-- the crank's bar -->
  <body name="crank"><joint name="crank" axis="0 -1 0" armature="0.002"/>
   <inertial pos="0.1 0 0" mass="0.4" diaginertia="1e-5 0.0013333333333333335 0.0013333333333333335"/>
   <geom name="crank" type="capsule" fromto="0 0 0 0.2 0 0" size="0.01" contype="0" conaffinity="0"/>
   <body name="rod" pos="0.2 0 0"><joint name="elbow" axis="0 -1 0"/>
    <inertial pos="0.22 0 0" mass="0.6" diaginertia="0.0002 0.0121 0.0122"/>
    <geom name="rod" type="capsule" fromto="0 0 0 0.5 0 0" size="0.008" contype="0" conaffinity="0"/>
    <site name="tip" pos="0.5 0 0"/>
   </body>
  </body>
  <body name="slider" pos="0.6 0 0"><joint name="slide" type="slide" axis="1 0 0" damping="1.5"/>
   <inertial pos="0 0 0" mass="0.9" diaginertia="1e-3 1e-3 1e-3"/>
   <site name="pin"/>
  </body>
 </worldbody>
 <equality><connect name="loop" site1="tip" site2="pin"/></equality>
</mujoco>
"""

ROBOT = """\
format = 1
name = "slider"
title = "Slider-crank"
model = "slider.xml"
actuated = ["crank"]
platform = { site = "pin", coordinates = ["x"], names = ["stroke"] }
initial = { crank = 0.9, elbow = -1.2 }
formulas = ["slider.py"]
limits = { crank = [0.3, 1.5] }

[groups]
m = ["m1", "m2", "m3"]

[parameters]
a = { at = ["offset rod x"], allowed = "> 0", meaning = "length of the crank" }
b = { at = ["site tip x"], follows = ["geom rod fromto x2"], allowed = "> 0" }
m1 = { at = ["mass crank"], allowed = "> 0", unit = "kg" }
m2 = { at = ["mass rod"], allowed = "> 0" }
m3 = { at = ["mass slider"], allowed = ">= 0" }
s1 = { at = ["com crank x"] }
s2 = { at = ["com rod x"] }
I1 = { at = ["inertia crank y", "inertia crank z"] }
I2 = { at = ["inertia rod y"] }
J = { at = ["armature crank"], allowed = ">= 0" }
c = { at = ["damping slide"], allowed = ">= 0", unit = "N s/m" }
g = { at = ["gravity"] }

[[bars]]
mass = "m1"
length = "a"
bodies = ["crank"]
"""

FORMULA = """\
import numpy as np
import workbench


@workbench.candidate("virtual-work", bound=1e-10)
def torque(p, q, qd, qdd):
    q, qd, qdd = q[:, 0], qd[:, 0], qdd[:, 0]
    f = np.arcsin(-p.a / p.b * np.sin(q))
    crank, rod = p.a * np.exp(1j * q), np.exp(1j * f)
    u = -p.a * np.cos(q) / (p.b * np.cos(f))
    fd = u * qd
    fdd = (p.a * (np.sin(q) * qd**2 - np.cos(q) * qdd) + p.b * np.sin(f) * fd**2) / (p.b * np.cos(f))
    turn = crank * (1j * qdd - qd**2)
    bend = rod * (1j * fdd - fd**2)
    along = (1j * crank + p.b * 1j * rod * u).real
    centre = 1j * crank + p.s2 * 1j * rod * u
    return (
        (p.I1 + p.m1 * p.s1**2 + p.J) * qdd
        + p.m1 * p.g * p.s1 * np.cos(q)
        + p.m2 * (np.conj(centre) * (turn + p.s2 * bend + 1j * p.g)).real
        + p.I2 * u * fdd
        + along * (p.m3 * (turn + p.b * bend).real + p.c * along * qd)
    )[:, None]
"""

CAMPAIGN = """\
format = 1
name = "slider"
title = "Slider-crank"
robot = "robot.toml"

[[case]]
name = "joint"
[case.motion]
kind = "sine"
offset = [0.9]
amplitude = [0.5]
frequency = [3.0]
stop = 1.0
samples = 21

[[case]]
name = "platform"
parameters = { m2 = 0.8 }
[case.motion]
kind = "platform_sine"
offset = [0.58]
amplitude = [0.05]
frequency = [4.0]
stop = 1.0
samples = 21
"""


def write_slider(folder: Path) -> None:
    """Write the robot's four files."""
    for name, text in {
        "slider.xml": MODEL, "robot.toml": ROBOT, "slider.py": FORMULA, "slider.toml": CAMPAIGN,
    }.items():  # fmt: skip
        (folder / name).write_text(text, encoding="utf-8")
