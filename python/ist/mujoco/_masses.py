"""Masses of bodies: those of the solids in place of those that MuJoCo infers from meshes."""

import mujoco
import numpy as np


def set_bodies(spec, model, solids):
    """Gives each body with solids (geom number: Solid) whose mass is inferred an explicit one."""
    infers = spec.compiler.inertiafromgeom
    if infers == mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE:
        return
    always = infers == mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE
    legacy = {mesh.name for mesh in spec.meshes if mesh.inertia in (
        mujoco.mjtMeshInertia.mjMESH_INERTIA_LEGACY, mujoco.mjtMeshInertia.mjMESH_INERTIA_EXACT)}
    groups = range(spec.compiler.inertiagrouprange[0], spec.compiler.inertiagrouprange[1] + 1)
    geoms = {geom.id: geom for geom in spec.geoms
             if geom.id in solids and geom.meshname in legacy and geom.group in groups}
    bodies = {body.id: body for body in spec.bodies if body.id > 0 and (always or not body.explicitinertial)}
    chosen = {body: [] for body in bodies}
    for number in geoms:
        chosen.get(int(model.geom_bodyid[number]), []).append(number)
    chosen = {body: numbers for body, numbers in chosen.items() if numbers}
    if not chosen:
        return
    rest = _without(spec, list(geoms))
    if rest.nbody != model.nbody or rest.ngeom != model.ngeom:
        return  # bodies are fused: their masses are MuJoCo's
    for number, numbers in chosen.items():
        parts = [(rest.body_mass[number], rest.body_ipos[number],
                  _turned(rest.body_iquat[number], np.diag(rest.body_inertia[number])))]
        for geom in numbers:
            parts.append(_part(model, geoms[geom], geom, solids[geom].asset))
        _give(bodies[number], parts)
    if always:
        spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_AUTO
        for number, body in bodies.items():
            body.explicitinertial = number in chosen


def _without(spec, numbers):
    """The model in which geoms have no mass."""
    copy = spec.copy()
    copy.compiler.settotalmass = -1
    copy.compiler.boundmass = copy.compiler.boundinertia = 1e-14  # MuJoCo refuses bodies without
    for geom in copy.geoms:
        if geom.id in numbers:
            geom.mass = 0
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
        return  # massless, which MuJoCo judges
    centre = sum(part[0] * part[1] for part in parts) / mass
    whole = np.zeros((3, 3))
    for part, place, inertia in parts:
        way = place - centre
        whole += inertia + part * (way @ way * np.eye(3) - np.outer(way, way))
    body.explicitinertial = True
    body.mass, body.ipos, body.iquat = mass, centre, [1, 0, 0, 0]
    body.fullinertia = [whole[0, 0], whole[1, 1], whole[2, 2], whole[0, 1], whole[0, 2], whole[1, 2]]
