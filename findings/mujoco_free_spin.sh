#!/usr/bin/env bash
# MuJoCo 4.0.0, no gravity, no contact, 240 steps of 1/240 s: a plate that turns by 0.2 rad a step has 1.36 times its
# kinetic energy after a second by the default integrator (Euler), 0.74 by implicit and implicitfast, 1.00 by RK4; at
# 0.5 rad a step 7.2, 0.19, 1.00. Where the body's frame lies beside its centre of mass, which changes no physics, these
# are 1.42 and 0.77, and 11.4 and 0.28.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check mujoco-core==4.0.0 numpy
cd "$folder"
venv/bin/python - <<'END'
import mujoco
import numpy as np

STEP = 1 / 240

def energy_kept(integrator, turn, aside):
    """After a second over before, of a plate whose frame is `aside` [m] of its centre of mass, which stays put."""
    model = mujoco.MjModel.from_xml_string(f"""<mujoco>
      <option timestep="{STEP}" gravity="0 0 0" integrator="{integrator}"><flag energy="enable"/></option>
      <worldbody><body><freejoint/><geom type="box" size=".05 .05 .005" pos="{aside} 0 0"/></body></worldbody></mujoco>""")
    data = mujoco.MjData(model)
    spin = turn / STEP * np.array([1, .3, .2]) / np.linalg.norm([1, .3, .2])
    data.qvel[3:], data.qvel[:3] = spin, -np.cross(spin, [aside, 0, 0])
    mujoco.mj_forward(model, data)
    before = data.energy[1]
    for _ in range(240):
        mujoco.mj_step(model, data)
    mujoco.mj_forward(model, data)
    return data.energy[1] / before

expected = {"Euler": (1.360, 1.417, 7.18, 11.39), "implicitfast": (0.740, 0.767, 0.190, 0.282),
            "implicit": (0.740, 0.767, 0.190, 0.282), "RK4": (1, 1, 1, 1)}
for integrator, wanted in expected.items():
    seen = [energy_kept(integrator, turn, aside) for turn in (0.2, 0.5) for aside in (0, 0.03)]
    print(f"{integrator:13}", *(f"{x:7.3f}" for x in seen))
    assert np.allclose(seen, wanted, rtol=5e-3), (integrator, seen)
END
