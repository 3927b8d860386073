"""ist as MuJoCo's narrow phase: concave meshes collide as the solids that they are.

    import mujoco, ist.mujoco

    spec = mujoco.MjSpec.from_file("scene.xml")
    ist.mujoco.attach(spec)          # bakes the meshes, once: see `cache`
    model = spec.compile()

`python -m ist.mujoco scene.xml` runs a scene. docs/mujoco.md has the settings that matter.
"""

import hashlib
import os
import pathlib

import ist
import mujoco

__all__ = ["attach", "load", "plugin_path"]

#: The version of MuJoCo that the plug-in is built for.
VERSION = "4.0.0"

_loaded = False


def plugin_path():
    """Path of libmujoco_ist.so, for hosts that load plug-ins themselves."""
    return str(pathlib.Path(__file__).with_name("libmujoco_ist.so"))


def load():
    """Loads the plug-in `ist.solid` into MuJoCo, once a process. Returns its path.

    Raises ImportError where MuJoCo is not of the version that the plug-in is built for, or where
    this build of ist has no plug-in.
    """
    global _loaded
    path = plugin_path()
    if _loaded:
        return path
    if mujoco.__version__ != VERSION:
        raise ImportError(f"ist.mujoco is built for MuJoCo {VERSION}, not {mujoco.__version__}. "
                          f"Install it: pip install mujoco=={VERSION}")
    if not os.path.exists(path):
        raise ImportError("this build of ist has no plug-in for MuJoCo: see docs/mujoco.md")
    mujoco.mj_loadPluginLibrary(path)
    _loaded = True
    return path


def attach(spec, geoms=None, cache=None, *, spheres=4000, patches=None, measure=None, repair=False):
    """Makes solids of the colliding mesh geoms of an MjSpec; returns their number.

    Each such geom becomes one of type sdf with an instance of the plug-in `ist.solid`. Its mesh is
    baked from the vertices that MuJoCo has, so scales of any kind are right, and has the solid's
    mass properties (inertia="exact"). Compile the spec afterwards.

    geoms: names of geoms; None: all mesh geoms with a contype or a conaffinity. A mesh that
        is left out does not collide with a solid.
    cache: folder of baked assets; None: $XDG_CACHE_HOME/ist or ~/.cache/ist.
    spheres: of each solid, at most.
    patches: contacts of a pair, at most, 1 to 50; None: 16 of exact overlaps, 8 of spheres.
        MuJoCo's own limit is sdf_initpoints (40).
    measure: "matched", "inner" or "exact"; exact between two solids that both have it. None: exact
        for meshes of at most 5,000 triangles, matched for others.

    repair: close open meshes (see ist.close_mesh) instead of refusing them.

    Raises ist.OpenMeshError for a mesh that is not closed: repair=True closes most; or leave it out
    of `geoms`.
    """
    load()
    model = spec.compile()
    wanted = None if geoms is None else set(geoms)
    if wanted is not None:
        unknown = wanted - {g.name for g in spec.geoms if g.type == mujoco.mjtGeom.mjGEOM_MESH}
        if unknown:
            raise ValueError(f"geoms: the scene has no mesh geom named {sorted(unknown)[0]!r}")
    folder = _folder(cache)
    instances = {}
    count = 0
    for geom in spec.geoms:
        if geom.type != mujoco.mjtGeom.mjGEOM_MESH:
            continue
        if wanted is not None and geom.name not in wanted:
            continue
        if wanted is None and model.geom_contype[geom.id] == 0 and model.geom_conaffinity[geom.id] == 0:
            continue
        mesh = int(model.geom_dataid[geom.id])
        if mesh not in instances:
            instances[mesh] = _instance(spec, model, mesh, geom.meshname, folder, spheres, patches, measure, repair)
        geom.type = mujoco.mjtGeom.mjGEOM_SDF
        geom.plugin.active = True
        geom.plugin.plugin_name = "ist.solid"
        geom.plugin.name = instances[mesh]
        count += 1
    return count


def _folder(cache):
    if cache is None:
        cache = pathlib.Path(os.environ.get("XDG_CACHE_HOME") or pathlib.Path.home() / ".cache") / "ist"
    folder = pathlib.Path(cache)
    folder.mkdir(parents=True, exist_ok=True)
    return folder.absolute()


def _instance(spec, model, mesh, name, folder, spheres, patches, measure, repair):
    path = _baked(model, mesh, name, folder, spheres, repair)  # or the spec stays as it is
    if not any(p.plugin_name == "ist.solid" for p in spec.plugins):
        spec.activate_plugin("ist.solid")
    plugin = spec.add_plugin(name=f"ist {name} {len(spec.plugins)}", plugin_name="ist.solid", active=True)
    plugin.config = {
        "file": str(path),
        "scale": "1",
    } | {key: str(value) for key, value in {"patches": patches, "measure": measure}.items() if value is not None}
    for m in spec.meshes:
        if m.name == name:
            m.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_EXACT
    return plugin.name


def _baked(model, mesh, name, folder, spheres, repair):
    """The asset of a compiled mesh, in the frame of its file but with its scale."""
    import numpy as np

    first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.mesh_quat[mesh])
    vertices = model.mesh_vert[first:first + count].astype(float) @ turn.reshape(3, 3).T + model.mesh_pos[mesh]
    first, count = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
    faces = np.ascontiguousarray(model.mesh_face[first:first + count], dtype=np.uint32)
    key = hashlib.sha256(f"{ist._core._bake_revision} {spheres} {repair} ".encode() + vertices.tobytes() + faces.tobytes())
    path = folder / f"{key.hexdigest()[:32]}.ist"
    if path.exists():
        try:
            ist.Asset.load(path)
            return path
        except ist.Error:  # of another format: baked again
            pass
    asset = ist.bake(ist.close_mesh(ist.Mesh(vertices, faces), name=name, repair=repair), max_spheres=spheres)
    part = path.with_suffix(f".{os.getpid()}")
    asset.save(part)
    os.replace(part, path)  # another process may bake the same
    return path
