"""How answers look at a prompt, and their rows."""

import html

import numpy as np


def text_of(answer):
    """All numbers of one answer; for many rows the count of each status."""
    name = type(answer).__name__
    columns = {key: getattr(answer, key) for key in vars(type(answer)) if not key.startswith("_")}
    status = np.asarray(answer.status)
    if rows := status.shape:
        from . import QueryStatus
        counts = ", ".join(f"{count:,} {QueryStatus(code).name}"
                           for code, count in zip(*np.unique(status, return_counts=True)))
        return f"<ist.{name} of {' × '.join(map(str, rows))} rows: {counts or 'none'}>"
    return f"ist.{name}(" + ", ".join(f"{key}={_value(x)}" for key, x in columns.items()) + ")"


def rows_of(answer):
    """len(answer): the number of its rows."""
    rows = np.shape(answer.status)
    if not rows:
        raise TypeError(f"this {type(answer).__name__} is of one pose: it has no rows")
    return rows[0]


def row_of(answer, index):
    """answer[index]: the answer of one row, or of some, by anything that NumPy takes for rows."""
    rows_of(answer)
    rows = np.arange(rows_of(answer))[index]
    parts = [part if part is None else part[rows] for part in answer.__getstate__()[0]]
    some = type(answer).__new__(type(answer))
    some.__setstate__((tuple(part.item() if isinstance(part, np.generic) else part for part in parts),))
    return some


def fields_of(report):
    """All that a report says, but what is 0, False or empty."""
    fields = {key: getattr(report, key) for key in vars(type(report)) if not key.startswith("_")}
    return f"ist.{type(report).__name__}(" + ", ".join(
        f"{key}={_value(x)}" for key, x in fields.items() if np.size(x) and np.any(x)) + ")"


def mesh_of(mesh):
    name = f" {mesh.name!r}" if hasattr(mesh, "name") else ""
    return f"<ist.{type(mesh).__name__}{name} of {len(mesh.vertices):,} vertices, {len(mesh.triangles):,} triangles>"


def _value(x):
    if isinstance(x, np.ndarray):
        return np.array2string(x, precision=6, separator=", ", threshold=24).replace("\n", "")
    return f"{x:.6g}" if isinstance(x, float) else getattr(x, "name", None) or repr(x)


def html_of(asset):
    return f"<pre>{html.escape(str(asset))}</pre>"
