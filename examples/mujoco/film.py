"""Draws scenes of compare.py by MuJoCo's renderer, side by side, into an animated picture.

    MUJOCO_GL=egl python film.py FILE.webp [SCENE…]

Scenes: mug, nut and hook by default; of the others docs/pictures/mujoco_more.webp is made, in rows of three:
pin, chain, bowl, pipe, gears, torch. The chain's last ring is pushed. Needs Pillow and, for MUJOCO_GL=egl,
PyOpenGL and a graphics card or Mesa.
"""

import pathlib
import sys
import tempfile

import mujoco
import numpy as np

import compare

SIZE, FRAMES, MS = (360, 400), 60, 50
# Steps a frame; where the camera looks [m], from how far, azimuth and elevation [degrees].
VIEWS = {"mug": (10, (0, 0, 0.075), 0.34, 120, -22), "nut": (10, (0, 0, 0.0095), 0.052, 135, -20),
         "hook": (25, (0, 0, -0.03), 0.30, 150, -14), "gears": (33, (0.0485, 0, 0), 0.30, 90, -50),
         "torch": (5, (0, 0, 0.04), 0.26, 120, -20), "pin": (2, (0, 0, 0), 0.11, 120, -22),
         "chain": (16, (0, 0, -0.032), 0.15, 120, -12), "bowl": (16, (0, 0, 0.03), 0.42, 120, -38),
         "pipe": (6, (0, 0, 0), 0.28, 90, -14)}
THROUGH = ("mug", "holder", "plate", "pipe")  # what the camera sees through
COLOURS = np.array([[.20, .47, .74, 1], [.90, .49, .20, 1], [.25, .62, .35, 1], [.75, .30, .38, 1], [.52, .42, .72, 1]])


def film(name, folder):
    """Frames of a scene, height × width × 3."""
    every, look, distance, azimuth, elevation = VIEWS[name]
    spec = compare.spec_of(compare.SCENES[name](), "ist", folder)
    spec.worldbody.add_light(pos=[.2, -.3, .6], dir=[-.3, .45, -.8], diffuse=[.5, .5, .5])
    spec.add_texture(name="sky", type=mujoco.mjtTexture.mjTEXTURE_SKYBOX, builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
                     rgb1=[1, 1, 1], rgb2=[.8, .86, .92], width=256, height=256)
    model = spec.compile()
    model.vis.map.znear = 0.02
    model.vis.headlight.ambient[:], model.vis.headlight.diffuse[:] = .35, .45
    moving = 0
    for geom in range(model.ngeom):
        if model.geom_bodyid[geom] == 0:
            model.geom_rgba[geom] = [.62, .66, .70, .4 if model.geom(geom).name in THROUGH else 1]
        else:
            model.geom_rgba[geom] = COLOURS[moving % len(COLOURS)]
            moving += 1
    data = mujoco.MjData(model)
    if name == "chain":
        data.qvel[-6] = .6
    mujoco.mj_forward(model, data)
    camera = mujoco.MjvCamera()
    camera.lookat[:], camera.distance, camera.azimuth, camera.elevation = look, distance, azimuth, elevation
    shots = []
    with mujoco.Renderer(model, SIZE[1], SIZE[0]) as renderer:
        for _ in range(FRAMES):
            renderer.update_scene(data, camera)
            shots.append(renderer.render().copy())
            for _ in range(every):
                mujoco.mj_step(model, data)
    return np.array(shots)


def main():
    scenes = sys.argv[2:] or ["mug", "nut", "hook"]
    if len(sys.argv) < 2 or sys.argv[1].startswith("-") or set(scenes) - set(VIEWS):
        sys.exit(__doc__.strip())
    from PIL import Image
    with tempfile.TemporaryDirectory() as temporary:
        panels = []
        for name in scenes:
            folder = pathlib.Path(temporary) / name
            folder.mkdir()
            panels.append(film(name, folder))
    rows = [np.concatenate(panels[i:i + 3], 2) for i in range(0, len(panels), 3)]
    frames = [Image.fromarray(frame) for frame in np.concatenate(rows, 1)]
    frames[0].save(sys.argv[1], save_all=True, append_images=frames[1:], duration=MS, loop=0, quality=70, method=6)


if __name__ == "__main__":
    main()
