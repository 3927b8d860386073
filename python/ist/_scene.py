"""What ist.torch and ist.jax share."""

import ist


def all_pairs(solids):
    """(n, 2): each Asset with each later one, and each Field with each Asset."""
    assets = [k for k, solid in enumerate(solids) if isinstance(solid, ist.Asset)]
    fields = [k for k, solid in enumerate(solids) if not isinstance(solid, ist.Asset)]
    return ([(f, a) for f in fields for a in assets] +
            [(a, b) for i, a in enumerate(assets) for b in assets[i + 1:]])
