import numpy as np

_WANTED = "(4, 4) or (n, 4, 4), (3, 3) or (n, 3, 3), or quaternions (4,) or (n, 4) with `order`"
_RIGID = 1e-6  # how far a matrix may be from a rotation, each entry of RᵀR


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
        return rows_of(given, "rotations")
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
        quaternions = _quaternions(given, "rotations")
    else:
        raise ValueError(f"rotations: shape {given.shape}; wanted {_WANTED}")
    try:
        lead = np.broadcast_shapes(quaternions.shape[:-1], moves.shape[:-1])
    except ValueError:
        raise ValueError(f"translations: {moves.shape[0]} rows; rotations have "
                         f"{quaternions.shape[0]}") from None
    return np.concatenate((np.broadcast_to(quaternions, (*lead, 4)),
                           np.broadcast_to(moves, (*lead, 3))), axis=-1)


def rows_of(matrices, name):
    """(…, 7) of (…, 4, 4)."""
    m = np.asarray(matrices, np.float64)
    last = m[..., 3, :]
    _refuse(np.abs(last - [0, 0, 0, 1]).max(axis=-1), name, "its last row is not 0, 0, 0, 1")
    return np.concatenate((_quaternions(m[..., :3, :3], name), m[..., :3, 3]), axis=-1)


def _doubles(value, name):
    given = np.asarray(value)
    if given.dtype.kind not in "fiu":
        raise TypeError(f"{name}: dtype {given.dtype}; wanted float64")
    return given.astype(np.float64)


def _refuse(error, name, why):
    bad = np.flatnonzero(error > _RIGID)  # NaN is none
    if len(bad):
        raise ValueError(f"{name}: matrix {bad[0]} is no rigid motion: {why}")


def _quaternions(r, name):
    """(…, 4), qw first, of rotation matrices."""
    with np.errstate(invalid="ignore"):
        off = np.abs(np.swapaxes(r, -1, -2) @ r - np.eye(3)).max(axis=(-1, -2))
        _refuse(off, name, "its columns are not of length 1 and at right angles")
        _refuse(-np.sign(np.linalg.det(r)), name, "it mirrors")
    x, y, z = r[..., 0, 0], r[..., 1, 1], r[..., 2, 2]
    # 4 q_k q, for each k: the longest of the four has no cancellation.
    rows = np.empty((*r.shape[:-2], 4, 4))
    rows[..., 0, 0], rows[..., 1, 1] = 1 + x + y + z, 1 + x - y - z
    rows[..., 2, 2], rows[..., 3, 3] = 1 - x + y - z, 1 - x - y + z
    for k, (i, j) in enumerate(((1, 2), (2, 0), (0, 1)), 1):
        rows[..., 0, k] = rows[..., k, 0] = r[..., j, i] - r[..., i, j]
        rows[..., i + 1, j + 1] = rows[..., j + 1, i + 1] = r[..., i, j] + r[..., j, i]
    lengths = np.linalg.norm(rows, axis=-1)
    best = np.argmax(lengths, axis=-1)[..., None, None]
    q = np.take_along_axis(rows, best, axis=-2)[..., 0, :]
    return q / np.take_along_axis(lengths, best[..., 0], axis=-1)
