#!/usr/bin/env bash
# Wheels as users get them: each in new environments without packages of the system, with NumPy 1.26
# and 2 where there are such, and the last with JAX and trimesh. PyPI is asked for these alone.
# usage: wheels.sh DIST FOLDER PYTHON…
set -euo pipefail
here=$(dirname "$(realpath "${BASH_SOURCE[0]}")")
dist=$(realpath "$1")
rm -rf "$2"
mkdir -p "$2"
cd "$2"
for python in "${@:3}"; do
  for numpy in '>=1.26,<2' '>=2'; do
    environment=$("$python" -c 'import sys; print("python%d.%d" % sys.version_info[:2])')-numpy${numpy:2:1}
    "$python" -m venv "$environment"
    pip=("$environment/bin/python" -m pip --quiet --disable-pip-version-check)
    if ! "${pip[@]}" install --only-binary :all: "numpy$numpy" 2>"$environment/numpy.log"; then
      echo "$environment: skipped, there is no such NumPy"
      continue
    fi
    "${pip[@]}" install --no-index --find-links "$dist" --only-binary ist ist
    echo "== $environment"
    "$environment/bin/python" "$here/wheel.py"
  done
done
echo "== $environment, JAX and trimesh"
"${pip[@]}" install jax pytest trimesh
cd "$here/../python"
IST_PROGRAM='' "$OLDPWD/$environment/bin/python" -m pytest -q -rs -p no:cacheprovider test_jax.py
"$OLDPWD/$environment/bin/python" - <<'END'
import ist, trimesh
assert abs(ist.bake(trimesh.creation.box((1, 2, 3)), max_spheres=100).volume - 6) < 1e-9
assert len(ist.from_trimesh(trimesh.creation.icosphere()).triangles) == 1280
END
