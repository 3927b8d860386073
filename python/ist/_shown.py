"""How answers look at a prompt."""

import html

import numpy as np


def text_of(answer):
    """All numbers of one answer; for many rows the count of each status."""
    name = type(answer).__name__
    columns = {key: getattr(answer, key) for key in vars(type(answer)) if not key.startswith("_")}
    status = np.asarray(answer.status)
    if rows := status.shape:
        kinds = type(answer)._statuses
        counts = ", ".join(f"{count:,} {kinds(code).name}"
                           for code, count in zip(*np.unique(status, return_counts=True)))
        return f"<ist.{name} of {' × '.join(map(str, rows))} rows: {counts or 'none'}>"
    return f"ist.{name}(" + ", ".join(f"{key}={_value(x)}" for key, x in columns.items()) + ")"


def _value(x):
    if isinstance(x, np.ndarray):
        return np.array2string(x, precision=6, separator=", ", threshold=24).replace("\n", "")
    return f"{x:.6g}" if isinstance(x, float) else getattr(x, "name", None) or repr(x)


def html_of(asset):
    return f"<pre>{html.escape(str(asset))}</pre>"
