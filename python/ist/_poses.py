import numpy as np

from . import _core

_WANTED = "(4, 4) or (n, 4, 4), (3, 3) or (n, 3, 3), or quaternions (4,) or (n, 4) with `order`"


def poses(rotations, translations=None, *, order=None):
    """Pose rows qw, qx, qy, qz, tx, ty, tz of this package, from other conventions.

    rotations: one of
        (4, 4) or (n, 4, 4): x_world = M (x, 1), without `translations`;
        (3, 3) or (n, 3, 3): rotation matrices;
        (4,) or (n, 4): quaternions, with `order`: "wxyz", or "xyzw" as in SciPy, ROS and three.js.
        Any non-zero length: they are normalised.
    translations: (3,) or (n, 3) [u]; None: zero.

    Returns (7,) or (n, 7) float64. NaN stays NaN: a query answers such a row with a status. Raises
    ValueError for a matrix that is no rigid motion, with its number.
    """
    given = _doubles(rotations, "rotations")
    tail = given.shape[-2:]
    if order is None and tail == (4, 4):
        if translations is not None:
            raise ValueError("translations: (4, 4) matrices already hold them; leave it out")
        return _core._poses(given, "rotations")
    moves = np.zeros(3) if translations is None else _doubles(translations, "translations")
    if moves.shape[-1:] != (3,):
        raise ValueError(f"translations: shape {moves.shape}; wanted (3,) or (n, 3)")
    if order is not None:
        if order not in ("wxyz", "xyzw"):
            raise ValueError(f"order: {order!r}; one of 'wxyz', 'xyzw'")
        if given.shape[-1:] != (4,):
            raise ValueError(f"rotations: shape {given.shape}; wanted quaternions (4,) or (n, 4)")
        quaternions = given if order == "wxyz" else np.roll(given, 1, axis=-1)
        with np.errstate(all="ignore"):
            quaternions = quaternions / np.linalg.norm(quaternions, axis=-1, keepdims=True)
    elif tail == (3, 3):
        matrices = np.zeros((*given.shape[:-2], 4, 4))
        matrices[..., :3, :3], matrices[..., 3, 3] = given, 1
        quaternions = _core._poses(matrices, "rotations")[..., :4]
    else:
        raise ValueError(f"rotations: shape {given.shape}; wanted {_WANTED}")
    try:
        lead = np.broadcast_shapes(quaternions.shape[:-1], moves.shape[:-1])
    except ValueError:
        raise ValueError(f"translations: {moves.shape[0]} rows; rotations have "
                         f"{quaternions.shape[0]}") from None
    return np.concatenate((np.broadcast_to(quaternions, (*lead, 4)),
                           np.broadcast_to(moves, (*lead, 3))), axis=-1)


def _doubles(value, name):
    given = np.asarray(value)
    if given.dtype.kind not in "fiu":
        raise TypeError(f"{name}: dtype {given.dtype}; wanted float64")
    return given.astype(np.float64)
