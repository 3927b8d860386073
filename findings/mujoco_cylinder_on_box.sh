#!/usr/bin/env bash
# Expected: a cylinder that rolls on a level floor without friction against rolling keeps its speed, whether the floor is a
# plane or a box. With MuJoCo 4.0.0 (solref .004 1, steps of 2 ms) it does on a plane, and a capsule does on both; on the
# face of a box the cylinder goes from 6 mm/s to 26 mm/s within a second: 4.4 times the speed, 19 times the energy.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q mujoco==4.0.0 numpy==2.3.4
cat >"$folder/ask.py" <<'END'
import mujoco


def speed_after(kind, floor, seconds=2):
    """[m/s] of a body of radius 20 mm that rolls at 6 mm/s."""
    model = mujoco.MjModel.from_xml_string(f"""
<mujoco>
  <option timestep="0.002"/>
  <default><geom solref=".004 1"/></default>
  <worldbody>
    {floor}
    <body pos="0 0 .01997" euler="90 0 0"><freejoint/><geom type="{kind}" size=".02 .03"/></body>
  </worldbody>
</mujoco>""")
    data = mujoco.MjData(model)
    data.qvel[:] = [.006, 0, 0, 0, 0, -.3]  # the axis is z of the body's frame
    for _ in range(round(seconds / model.opt.timestep)):
        mujoco.mj_step(model, data)
    return data.qvel[0]


floors = dict(plane='<geom type="plane" size="5 5 1"/>', box='<geom type="box" size="5 5 1" pos="0 0 -1"/>')
speeds = {(kind, name): round(speed_after(kind, floor), 4)
          for kind in ("cylinder", "capsule") for name, floor in floors.items()}
print(mujoco.__version__, speeds)
assert speeds.pop(("cylinder", "box")) > 0.02
assert all(speed == 0.006 for speed in speeds.values())
END
"$folder/venv/bin/python" "$folder/ask.py"
