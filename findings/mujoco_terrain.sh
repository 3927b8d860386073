#!/usr/bin/env bash
# MuJoCo 4.0.0 reserves no contact for a height field with a geom of type sdf, though the pair passes its filters and
# has a collision function: mj_maxContact() says 0, where it says 50 for the same mesh as its hull and 40 for the sdf on
# a box. A warning says that the pair is not supported; a function of one's own in mjCOLLISIONFUNC has no room either.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check mujoco-core==4.0.0 numpy
cd "$folder"
venv/bin/python - <<'END'
import ctypes, pathlib
import mujoco

def model(kind, ground):
    return mujoco.MjModel.from_xml_string(f"""<mujoco>
      <asset><hfield name="h" nrow="3" ncol="3" size="1 1 .1 .1" elevation="0 0 0 0 0 0 0 0 1"/>
        <mesh name="m" vertex="-1 -1 -1  1 -1 -1  -1 1 -1  1 1 -1  -1 -1 1  1 -1 1  -1 1 1  1 1 1" scale=".05 .05 .05"/></asset>
      <worldbody><geom {ground}/><body pos="0 0 .06"><freejoint/><geom type="{kind}" mesh="m"/></body></worldbody></mujoco>""")

library = ctypes.CDLL(str(pathlib.Path(mujoco.__file__).with_name("libmujoco.so.4.0.0")))
library.mj_maxContact.argtypes = [ctypes.c_void_p, ctypes.c_int, ctypes.c_int, ctypes.c_int]
seen = {}
for name, kind, ground in (("hull on terrain", "mesh", 'type="hfield" hfield="h"'),
                           ("sdf on terrain", "sdf", 'type="hfield" hfield="h"'),
                           ("sdf on box", "sdf", 'type="box" size="1 1 .1" pos="0 0 -.1"')):
    m = model(kind, ground)
    d = mujoco.MjData(m)
    for _ in range(80):
        mujoco.mj_step(m, d)
    seen[name] = (library.mj_maxContact(m._address, 0, 1, 0), bool(d.qpos[2] > 0))
    print(f"{name}: room for {seen[name][0]} contacts, {'rests' if seen[name][1] else 'falls through'}")
assert seen == {"hull on terrain": (50, True), "sdf on terrain": (0, False), "sdf on box": (40, True)}, seen
END
