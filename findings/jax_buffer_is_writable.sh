#!/usr/bin/env bash
# Expected: a callback of jax.experimental.buffer_callback gets its arguments read-only, as JAX's arrays never change. With
# JAX 0.10.2 on the CPU the argument's Buffer says writeable=False and its DLPack export is read-only, but NumPy's view of
# the same Buffer may be written to, and then the caller's immutable array has changed: 1.0 becomes 5.0.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q jax==0.10.2 jaxlib==0.10.2 numpy==2.3.4
cat >"$folder/ask.py" <<'END'
import jax
import jax.numpy as jnp
import numpy as np
from jax.experimental.buffer_callback import buffer_callback

seen = {}


def work(context, out, x):
    seen.update(buffer=x.writeable, dlpack=np.from_dlpack(x).flags.writeable, numpy=np.asarray(x).flags.writeable)
    np.asarray(out)[...] = 0
    if seen["numpy"]:
        np.asarray(x)[0] = 5


x = jnp.ones(3)
buffer_callback(work, jax.ShapeDtypeStruct(x.shape, x.dtype))(x).block_until_ready()
print("may be written to:", seen, "the caller's array:", x)
assert seen == dict(buffer=False, dlpack=False, numpy=True)
assert float(x[0]) == 5
END
JAX_PLATFORMS=cpu "$folder/venv/bin/python" "$folder/ask.py"
