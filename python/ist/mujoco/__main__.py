"""python -m ist.mujoco SCENE.xml: runs a scene whose meshes collide as solids."""

import argparse
import json
import sys
import time

import ist
import ist.mujoco
import mujoco
import numpy as np


def main(arguments=None):
    parser = argparse.ArgumentParser(
        prog="python -m ist.mujoco",
        description="Run a MuJoCo scene whose meshes collide as the solids that they are.",
        formatter_class=argparse.ArgumentDefaultsHelpFormatter)
    parser.add_argument("scene", help="MJCF or URDF file")
    parser.add_argument("--seconds", type=float, default=3, help="simulated time [s]")
    parser.add_argument("--stock", action="store_true", help="leave collisions to MuJoCo, to compare")
    parser.add_argument("--spheres", type=int, default=4000, help="of each solid, at most")
    parser.add_argument("--patches", type=int, help="contacts of a pair, at most, 1 to 50")
    parser.add_argument("--measure", choices=("matched", "inner", "exact"))
    parser.add_argument("--repair", action="store_true", help="close meshes that are open")
    parser.add_argument("--cache", help="folder of baked assets (default: ~/.cache/ist)")
    parser.add_argument("--film", metavar="OUT.glb", help="write the motion, 30 frames a second")
    parser.add_argument("--json", action="store_true", help="report as JSON on stdout")
    options = parser.parse_args(arguments)
    try:
        report = run(options)
    except (OSError, ValueError, ImportError, ist.Error) as error:
        print(f"ist.mujoco: {error}", file=sys.stderr)
        return 1
    if options.json:
        print(json.dumps(report))
    else:
        print("{solids} solids, {steps} steps of {step_ms:g} ms: {steps_per_second:.0f} steps/s, "
              "{real_time:.2f} × real time\n"
              "deepest contact {deepest_mm:.3g} mm, most contacts {most_contacts}\n"
              "energy {energy_first:.4g} J at the start, {energy_last:.4g} J at the end, fastest body "
              "{fastest_mm_s:.3g} mm/s at the end".format(**report))
    return 0


def run(options):
    spec = mujoco.MjSpec.from_file(options.scene)
    solids = 0
    if not options.stock:
        say(options, "baking the meshes that are not in the cache")
        solids = ist.mujoco.attach(spec, cache=options.cache, spheres=options.spheres,
                                   patches=options.patches, measure=options.measure, repair=options.repair)
    model = spec.compile()
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    energy_first = float(data.energy.sum())
    film = None
    if options.film:
        from ist.mujoco.film import Film
        film = Film(model)
    steps = max(1, round(options.seconds / model.opt.timestep))
    deepest, most, spent, told = 0.0, 0, 0.0, time.monotonic()
    for step in range(steps):
        start = time.perf_counter()
        mujoco.mj_step(model, data)
        spent += time.perf_counter() - start
        if data.ncon:
            deepest = max(deepest, -float(data.contact.dist.min()))
        most = max(most, data.ncon)
        if not np.isfinite(data.qpos).all() or data.warning[mujoco.mjtWarning.mjWARN_BADQACC].number:
            raise ValueError(f"the simulation is unstable at {data.time:.3f} s: use a shorter timestep "
                             "or a softer solref")
        if film is not None:
            film.add(data)
        if time.monotonic() - told > 1:
            told = time.monotonic()
            say(options, f"{data.time:.2f} of {options.seconds:g} s, {data.ncon} contacts", end="\r")
    say(options, " " * 60, end="\r")
    if film is not None:
        film.write(options.film)
    velocity, fastest = np.empty(6), 0.0
    for body in range(1, model.nbody):
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_BODY, body, velocity, 0)
        fastest = max(fastest, float(np.linalg.norm(velocity[3:])))
    return {
        "scene": options.scene, "solids": solids, "steps": steps,
        "step_ms": model.opt.timestep * 1e3, "steps_per_second": steps / spent,
        "real_time": steps * model.opt.timestep / spent, "deepest_mm": deepest * 1e3,
        "most_contacts": most, "energy_first": energy_first, "energy_last": float(data.energy.sum()),
        "fastest_mm_s": fastest * 1e3,
    }


def say(options, text, end="\n"):
    if not options.json and sys.stderr.isatty():
        print(text, end=end, file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
