"""Collision of solids by inner sphere trees: docs/python.md, and help() of every name.

Lengths are [u], whatever unit the meshes have. Poses are rows qw, qx, qy, qz, tx, ty, tz of float64:
x_world = R(q) (scale · x) + t. What is refused raises ist.Error with the library's text; arrays of a
wrong shape raise ValueError, of a wrong dtype TypeError.
"""

import copyreg
import enum

from . import _core
from ._core import *  # noqa: F403
from ._core import __version__


# Functions go to other processes by their names.
copyreg.pickle(type(_core.penetration), lambda function: function.__qualname__)


class QueryStatus(enum.IntEnum):
    """Codes of `status` of a Penetration or a Separation."""

    ok = 0
    budget_exhausted = 1  # a limit stopped it: volume_min, volume_max hold the finished answer's
    invalid_input = 2  # the row is all zero
    not_held = 3  # a solid does not hold what is asked: the row is all NaN; one pose raises Error


class Overlapping(enum.IntEnum):
    """Codes that overlap() answers."""

    no = 0
    yes = 1
    unknown = 2


class ImpactStatus(enum.IntEnum):
    """Codes of `status` of a TimeOfImpact."""

    no_impact = 0
    impact = 1
    unresolved = 2
    overlapping = 3
    budget_exhausted = 4
    invalid_input = 5
    not_held = 6


__all__ = sorted(
    [name for name in vars(_core) if not name.startswith("_")]
    + ["QueryStatus", "Overlapping", "ImpactStatus", "__version__"]
)
