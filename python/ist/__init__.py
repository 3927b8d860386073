"""Collision of solids by inner sphere trees: docs/python.md, and help() of every name.

Lengths are [u], whatever unit the meshes have. Poses are rows qw, qx, qy, qz, tx, ty, tz of float64:
x_world = R(q) (scale · x) + t. Errors of the library raise ist.Error with its message; arrays of a
wrong shape raise ValueError, of a wrong dtype TypeError.
"""

import enum

from . import _calls, _core, _shown

# Before any import from there. One answer's code is an enum's.
for _owner in (_core, _core.gpu, *(x for x in vars(_core).values() if isinstance(x, type))):
    _calls.name_faults(_owner, {name: lambda codes: _one(codes, YesNo)
                                for name in ("overlap", "contains")})

from ._core import *  # noqa: E402, F403
from ._core import __version__  # noqa: E402
from ._plot import Plot, plot  # noqa: E402
from ._poses import poses  # noqa: E402

for _shown_here in (Plot, plot, poses):
    _shown_here.__module__ = "ist"


class QueryStatus(enum.IntEnum):
    """Codes of `status` of a Penetration or a Separation."""

    ok = 0
    budget_exhausted = 1  # a limit stopped it: volume_min, volume_max contain the finished answer's
    # The row is all NaN; a query of a single pose raises instead:
    invalid_input = 2  # a pose, a scale or a Shape's number is invalid: ValueError
    missing_data = 3  # a solid lacks what the measure needs: Error
    error_exceeded = 4  # finished, but the error is larger than relative_error


class YesNo(enum.IntEnum):
    """Codes that overlap() and contains() return."""

    no = 0
    yes = 1
    unknown = 2


class ImpactKind(enum.IntEnum):
    """Codes of `kind` of a TimeOfImpact; no_impact where the status is not ok."""

    no_impact = 0
    impact = 1
    unresolved = 2
    overlapping = 3


def _finish():
    """Answers and assets show what they are."""
    for kind in (Penetration, Separation, ContactPatches, TimeOfImpact, RayHits,  # noqa: F405
                 SurfacePoints):  # noqa: F405
        kind.__repr__ = _shown.text_of
        kind.__len__, kind.__getitem__ = _shown.rows_of, _shown.row_of
        kind.__bool__ = lambda self: True  # whatever the number of rows
        for name, codes in ("status", QueryStatus), ("kind", ImpactKind):
            if column := vars(kind).get(name):
                setattr(kind, name, property(
                    lambda self, column=column, codes=codes: _one(column.fget(self), codes), None,
                    None, column.__doc__))
    for kind in (MeshReport, MassProperties, Bounds, SizeMatch, Invariant, PartnerError,  # noqa: F405
                 TargetedAsset, Progress):  # noqa: F405
        kind.__repr__ = _shown.fields_of
    for kind in (Mesh, ClosedMesh):  # noqa: F405
        kind.__repr__ = _shown.mesh_of
    Asset._repr_html_ = _shown.html_of  # noqa: F405


def _one(codes, kind):
    return kind(codes) if isinstance(codes, int) else codes


_finish()

__all__ = sorted(
    [name for name in vars(_core) if not name.startswith("_")]
    + ["QueryStatus", "YesNo", "ImpactKind", "__version__", "Plot", "plot", "poses"]
)
