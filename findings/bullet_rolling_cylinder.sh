#!/usr/bin/env bash
# A cylinder (1 kg, radius 0.1 m, 1 m long) that rolls on a plane at 0.1 m/s rolls ever faster by pybullet 3.2.7 (Bullet).
# After 20 s at 240 Hz, pybullet's own step, it rolls at 1.1 m/s, 120 times the energy, without damping, and at 0.34 m/s
# with pybullet's own damping of 0.04. At 60 Hz it rolls at 1.6 m/s and sinks by 4 cm of its radius, at 1,000 Hz at 0.22
# m/s. A capsule does the same; a sphere keeps its 0.1 m/s.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check pybullet==3.2.7 numpy==2.2.6
"$folder/venv/bin/python" - <<'END'
import math

import pybullet as p

RADIUS, SPEED, SECONDS = 0.1, 0.1, 20

def speed_and_height(shape, hz, damping):
    """[m/s], [m] of a round body after SECONDS of rolling along x."""
    p.connect(p.DIRECT)
    p.setGravity(0, 0, -9.81)
    p.setTimeStep(1 / hz)
    p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    size = {} if shape == p.GEOM_SPHERE else {"height": 1.0}
    body = p.createMultiBody(1, p.createCollisionShape(shape, radius=RADIUS, **size), basePosition=[0, 0, RADIUS],
                             baseOrientation=p.getQuaternionFromEuler([math.pi / 2, 0, 0]))
    p.changeDynamics(body, -1, linearDamping=damping, angularDamping=damping)
    p.resetBaseVelocity(body, [SPEED, 0, 0], [0, SPEED / RADIUS, 0])
    for _ in range(SECONDS * hz):
        p.stepSimulation()
    found = math.hypot(*p.getBaseVelocity(body)[0]), p.getBasePositionAndOrientation(body)[0][2]
    p.disconnect()
    return found

for name, shape, hz, damping, wanted in (
        ("cylinder", p.GEOM_CYLINDER, 240, 0, 1.10), ("cylinder", p.GEOM_CYLINDER, 240, 0.04, 0.337),
        ("cylinder", p.GEOM_CYLINDER, 60, 0, 1.59), ("cylinder", p.GEOM_CYLINDER, 1000, 0, 0.222),
        ("capsule", p.GEOM_CAPSULE, 240, 0, 0.881), ("sphere", p.GEOM_SPHERE, 240, 0, 0.1)):
    speed, height = speed_and_height(shape, hz, damping)
    print(f"{name:8} at {hz:4} Hz, damping {damping}: {speed:.3f} m/s, its middle at {height:.4f} m")
    assert abs(speed - wanted) < 0.05 * wanted, (name, speed, wanted)
END
