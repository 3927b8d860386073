"""ist as MuJoCo's narrow phase: concave meshes collide as the solids that they are.

    import mujoco, ist.mujoco

    spec = mujoco.MjSpec.from_file("scene.xml")
    ist.mujoco.attach(spec)          # bakes the meshes, once: see `cache`
    model = spec.compile()

`python -m ist.mujoco scene.xml` runs a scene. docs/mujoco.md has the settings that matter.
"""

from __future__ import annotations

import collections.abc
import ctypes
import os
import pathlib
import typing
import warnings

import ist
import mujoco
from ist.mujoco import _masses, _solids

__all__ = ["attach", "load", "plugin_path"]

#: The version of MuJoCo that the plug-in is built for, without the number of the fix.
VERSION = "4.0"

_loaded = False


def plugin_path() -> str:
    """Path of libmujoco_ist.so, for hosts that load plug-ins themselves."""
    return str(pathlib.Path(__file__).with_name("libmujoco_ist.so"))


def load() -> str:
    """Loads the plug-in `ist.solid` into MuJoCo, once a process. Returns its path.

    The import of ist.mujoco has called it: a model from an .mjb file needs no more than the import.

    Raises ImportError where MuJoCo is not of the version that the plug-in is built for, or where
    this build of ist has no plug-in.
    """
    global _loaded
    path = plugin_path()
    if _loaded:
        return path
    if mujoco.__version__.split(".")[:2] != VERSION.split("."):
        raise ImportError(f"ist.mujoco is built for MuJoCo {VERSION}, not {mujoco.__version__}. "
                          f"Install it: pip install 'mujoco=={VERSION}.*'")
    if not os.path.exists(path):
        raise ImportError("this build of ist has no plug-in for MuJoCo: see docs/mujoco.md")
    # The plug-in finds MuJoCo's functions by name: it does not depend on the library's version.
    library = pathlib.Path(mujoco.__file__).with_name(f"libmujoco.so.{mujoco.__version__}")
    ctypes.CDLL(str(library), mode=ctypes.RTLD_GLOBAL)
    mujoco.mj_loadPluginLibrary(path)
    _loaded = True
    return path


def attach(spec: mujoco.MjSpec, geoms: collections.abc.Iterable[str] | None = None,
           cache: str | os.PathLike[str] | None = None, *, spheres: int = 4000,
           patches: int | None = None,
           measure: typing.Literal["matched", "inner", "exact"] | None = None,
           repair: bool = False) -> int:
    """Makes solids of the colliding mesh geoms of an MjSpec; returns their number.

    Each such geom becomes one of type sdf with an instance of the plug-in `ist.solid`. Its mesh is
    baked from its file, or from MuJoCo's copy where there is no file that ist reads, with the
    mesh's scale, refpos and refquat. A body whose mass MuJoCo infers gets the mass and inertia of
    its solids, at each geom's density or mass. Compile the spec afterwards.

    geoms: names of geoms; None: all mesh geoms that collide, by contype and conaffinity or in a
        <pair>. A mesh that is left out stays its hull, for solids too.
    cache: folder of baked assets; None: $XDG_CACHE_HOME/ist or ~/.cache/ist.
    spheres: of each solid, at most; baked where the measure is not "exact".
    patches: contacts of a pair, at most, 1 to 50; None: 16 of exact overlaps, 8 of spheres.
        MuJoCo's own limit is sdf_initpoints (40).
    measure: None or "exact": the true overlap, between two solids that both have it and with
        primitive geoms. A solid whose mesh cannot serve has "inner" by default. "matched" and
        "inner": by spheres.
    repair: close the holes of meshes that are not closed, as ist.close_mesh(…, repair=True).

    Warns of the meshes that cannot be baked, which stay MuJoCo's hulls, of findings of bakes (not of
    those in the cache), of files that MuJoCo has read differently, and of flexes that solids do not
    meet. Raises
    ist.OpenMeshError for such a mesh of a geom that `geoms` names, and ValueError or TypeError for
    an argument; then the spec is as it was.
    """
    load()
    if not isinstance(spec, mujoco.MjSpec):
        raise TypeError(f"attach takes an MjSpec, not {type(spec).__name__}: "
                        "mujoco.MjSpec.from_file(path)")
    if isinstance(geoms, str):
        raise TypeError(f"geoms is a list of names: [{geoms!r}]")
    if patches is not None and not (isinstance(patches, int) and 1 <= patches <= 50):
        raise ValueError(f"patches={patches!r} is not a whole number from 1 to 50")
    if measure not in (None, "matched", "inner", "exact"):
        raise ValueError(f"measure={measure!r} is none of 'matched', 'inner', 'exact'")
    model = spec.compile()
    wanted = None if geoms is None else set(geoms)
    meshes = [geom for geom in spec.geoms if geom.type == mujoco.mjtGeom.mjGEOM_MESH and geom.id >= 0]
    if wanted is None:
        paired = {name for pair in spec.pairs for name in (pair.geomname1, pair.geomname2)}
        chosen = [geom for geom in meshes if model.geom_contype[geom.id] or model.geom_conaffinity[geom.id]
                  or geom.name in paired]
    else:
        unknown = wanted - {geom.name for geom in meshes}
        if unknown:
            raise ValueError(f"geoms: the scene has no mesh geom named {sorted(unknown)[0]!r}")
        chosen = [geom for geom in meshes if geom.name in wanted]
    folder = _folder(cache)
    solids: dict[int, _solids.Solid | None] = {}
    hulls, findings = [], []
    for geom in chosen:
        mesh = int(model.geom_dataid[geom.id])
        if mesh in solids:
            continue
        try:
            solids[mesh] = _solids.of_mesh(spec, model, mesh, geom.meshname, folder, spheres, measure, repair,
                                           findings)
        except ist.Error as error:
            if wanted is not None:
                raise
            solids[mesh] = None
            hulls.append(str(error).split(". ")[0])  # without the remedies of other programs
    if hulls:
        way = "" if repair else "attach(repair=True) may close them, "
        _warn(f"{len(hulls)} of {len(solids)} meshes stay the hulls that MuJoCo makes of them; {way}geoms= can leave "
              f"them out: {' | '.join(hulls)}")
    if findings:
        _warn(f"{len(findings)} of {len(solids)} meshes became solids in spite of: {' | '.join(findings)}")
    for flex in spec.flexes:
        if chosen and flex.dim != 2 and (flex.contype or flex.conaffinity):
            _warn(f"flex {flex.name!r} does not meet solids: MuJoCo collides only flexes of dim 2 with geoms of type sdf")
    # Nothing has been changed before this line.
    chosen = [geom for geom in chosen if solids[int(model.geom_dataid[geom.id])] is not None]
    _masses.set_bodies(spec, model, {geom.id: solids[int(model.geom_dataid[geom.id])] for geom in chosen})
    instances: dict[int, str] = {}
    for geom in chosen:
        mesh = int(model.geom_dataid[geom.id])
        if mesh not in instances:
            instances[mesh] = _instance(spec, geom.meshname, solids[mesh], patches, measure)
        geom.type = mujoco.mjtGeom.mjGEOM_SDF
        geom.plugin.active = True
        geom.plugin.plugin_name = "ist.solid"
        geom.plugin.name = instances[mesh]
    _meet_terrains(spec, chosen)
    return len(chosen)


def _meet_terrains(spec, solids):
    """MuJoCo has no room for contacts of a height field with a geom of type sdf: hulls meet it."""
    terrains = [geom for geom in spec.geoms if geom.type == mujoco.mjtGeom.mjGEOM_HFIELD]
    excluded = {frozenset((pair.bodyname1, pair.bodyname2)) for pair in spec.excludes}
    taken = {geom.name for geom in spec.geoms}

    def named(geom, like):
        if not geom.name:
            geom.name = next(name for name in (f"{like} {k}" for k in range(len(taken) + 1)) if name not in taken)
            taken.add(geom.name)
        return geom.name

    for solid in solids if terrains else ():
        hull = None
        for terrain in terrains:
            names = {terrain.name, solid.name}
            paired = [pair for pair in spec.pairs if {pair.geomname1, pair.geomname2} == names]
            if not paired and (
                    not (solid.contype & terrain.conaffinity or terrain.contype & solid.conaffinity)
                    or solid.parent.id == terrain.parent.id
                    or frozenset((solid.parent.name, terrain.parent.name)) in excluded):
                continue
            if hull is None:
                hull = solid.parent.add_geom(
                    type=mujoco.mjtGeom.mjGEOM_MESH, meshname=solid.meshname, pos=solid.pos, quat=solid.quat,
                    contype=0, conaffinity=0, mass=0, rgba=[0, 0, 0, 0], group=solid.group,
                    friction=solid.friction, solref=solid.solref, solimp=solid.solimp, condim=solid.condim,
                    margin=solid.margin, gap=solid.gap, priority=solid.priority, solmix=solid.solmix)
                named(hull, "ist hull")
            for pair in paired:
                pair.geomname1, pair.geomname2 = named(terrain, "ist terrain"), hull.name
            if not paired:
                first = max((solid, terrain), key=lambda geom: (geom.priority, geom.condim))
                undefined = float("nan")  # MuJoCo mixes the values of the two geoms
                spec.add_pair(geomname1=named(terrain, "ist terrain"), geomname2=hull.name, condim=first.condim,
                              friction=[undefined] * 5, solref=[undefined] * 2, solimp=[undefined] * 5,
                              margin=undefined, gap=undefined)


def _warn(text):
    warnings.warn(f"ist.mujoco: {text}", stacklevel=3)


def _folder(cache):
    if cache is None:
        cache = pathlib.Path(os.environ.get("XDG_CACHE_HOME") or pathlib.Path.home() / ".cache") / "ist"
    folder = pathlib.Path(cache)
    folder.mkdir(parents=True, exist_ok=True)
    return folder.absolute()


def _instance(spec, name, solid, patches, measure):
    if not any(p.plugin_name == "ist.solid" for p in spec.plugins):
        spec.activate_plugin("ist.solid")
    plugin = spec.add_plugin(name=f"ist {name} {len(spec.plugins)}", plugin_name="ist.solid", active=True)
    plugin.config = {"file": str(solid.path), "scale": "1"} | {
        key: str(value) for key, value in {"patches": patches, "measure": measure}.items() if value is not None}
    stock = any(geom.type == mujoco.mjtGeom.mjGEOM_SDF and geom.meshname == name and not geom.plugin.active
                for geom in spec.geoms)
    for mesh in spec.meshes:
        if mesh.name == name and not stock:
            mesh.octree_maxdepth = 1  # MuJoCo makes an octree of each sdf geom's mesh: unused here
    return plugin.name


load()
