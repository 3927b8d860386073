"""Masses of bodies: those of the solids in place of those that MuJoCo infers from meshes."""

import warnings

import mujoco
import numpy as np


def set_bodies(spec, model, solids):
    """Gives each body with solids (geom number: Solid) whose mass is inferred an explicit one."""
    rule = mujoco.mjtInertiaFromGeom  # each body has the compiler settings of the file that it comes from
    legacy = {mesh.name for mesh in spec.meshes if mesh.inertia in (
        mujoco.mjtMeshInertia.mjMESH_INERTIA_LEGACY, mujoco.mjtMeshInertia.mjMESH_INERTIA_EXACT)}
    geoms = {geom.id: geom for geom in spec.geoms if geom.id in solids and geom.meshname in legacy
             and geom.compiler.inertiagrouprange[0] <= geom.group <= geom.compiler.inertiagrouprange[1]}
    always = {body.id: body for body in spec.bodies
              if body.id > 0 and body.compiler.inertiafromgeom == rule.mjINERTIAFROMGEOM_TRUE}
    bodies = always | {body.id: body for body in spec.bodies if body.id > 0 and not body.explicitinertial
                       and body.compiler.inertiafromgeom == rule.mjINERTIAFROMGEOM_AUTO}
    chosen = {body: [] for body in bodies}
    for number in geoms:
        chosen.get(int(model.geom_bodyid[number]), []).append(number)
    chosen = {body: numbers for body, numbers in chosen.items() if numbers}
    if not chosen:
        return
    rest = _without(spec, list(geoms))
    if rest.nbody != model.nbody or rest.ngeom != model.ngeom:
        return  # bodies are fused: MuJoCo computes their masses
    for number, numbers in chosen.items():
        parts = [(rest.body_mass[number], rest.body_ipos[number],
                  _turned(rest.body_iquat[number], np.diag(rest.body_inertia[number])))]
        for geom in numbers:
            parts.append(_part(model, geoms[geom], geom, solids[geom].asset))
        _give(bodies[number], parts)
    for number, body in always.items():
        body.compiler.inertiafromgeom = rule.mjINERTIAFROMGEOM_AUTO
        body.explicitinertial = number in chosen


def _without(spec, numbers):
    """The model in which geoms have no mass."""
    copy = spec.copy()
    copy.compiler.settotalmass = -1
    for body in copy.bodies:
        body.compiler.boundmass = body.compiler.boundinertia = 1e-14  # MuJoCo refuses bodies without
        if body.compiler.inertiafromgeom == mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE:
            # MuJoCo uses the file's values if no geom has a mass.
            body.mass, body.inertia, body.fullinertia = 0, [0] * 3, [np.nan] * 6
    for geom in copy.geoms:
        if geom.id in numbers:
            geom.mass = 0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of matrices near singular, which this model alone has
        return copy.compile()


def _part(model, geom, number, asset):
    """Mass, centre and inertia about it of a solid, in the frame of its body."""
    own = asset.mass_properties()
    mass = geom.density * own.volume if np.isnan(geom.mass) else geom.mass
    mesh = model.geom_dataid[number]
    back, quat, shift = np.zeros(4), np.zeros(4), np.zeros(3)
    mujoco.mju_negQuat(back, model.mesh_quat[mesh])
    mujoco.mju_mulQuat(quat, model.geom_quat[number], back)
    mujoco.mju_rotVecQuat(shift, own.centre_of_mass - model.mesh_pos[mesh], quat)
    return mass, model.geom_pos[number] + shift, _turned(quat, own.inertia) * (mass / own.volume)


def _turned(quat, inertia):
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, quat)
    turn = turn.reshape(3, 3)
    return turn @ inertia @ turn.T


def _give(body, parts):
    mass = sum(part[0] for part in parts)
    if not mass > 1e-12:
        return  # massless bodies are left to MuJoCo's checks
    centre = sum(part[0] * part[1] for part in parts) / mass
    whole = np.zeros((3, 3))
    for part, place, inertia in parts:
        way = place - centre
        whole += inertia + part * (way @ way * np.eye(3) - np.outer(way, way))
    body.explicitinertial = True
    body.mass, body.ipos, body.iquat, body.inertia = mass, centre, [1, 0, 0, 0], [0] * 3
    body.fullinertia = [whole[0, 0], whole[1, 1], whole[2, 2], whole[0, 1], whole[0, 2], whole[1, 2]]
