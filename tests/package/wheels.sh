#!/usr/bin/env bash
# Wheels as users get them: each in new environments without packages of the system, with NumPy 1.26
# and 2 where there are such, and the last with JAX, trimesh and MuJoCo. PyPI is asked for these alone,
# and for models of MuJoCo's.
# Tests the wheels without the GPU, which have the version of the source package.
# usage: wheels.sh DIST FOLDER PYTHON…
set -euo pipefail
here=$(dirname "$(realpath "${BASH_SOURCE[0]}")")
dist=$(realpath "$1")
version=$(basename "$dist"/ist-*.tar.gz .tar.gz)
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
    "${pip[@]}" install --no-index --find-links "$dist" --only-binary ist "ist===${version#ist-}"
    echo "== $environment"
    "$environment/bin/python" "$here/wheel.py"
  done
done
echo "== $environment, JAX, trimesh and MuJoCo"
bin=$PWD/$environment/bin
mujoco=$("$bin/python" -c 'from importlib.metadata import requires
print(*(r.split(";")[0] for r in requires("ist") if r.startswith("mujoco")))')
"${pip[@]}" install jax pytest trimesh "$mujoco"
mapfile -t models < <(sed -n 's/^mujoco_models=(\(.*\))$/\1/p' "$here/../../dev" | tr ' ' '\n')
"${pip[@]}" install --no-deps "${models[@]}"
export PYTHONDONTWRITEBYTECODE=1 IST_PROGRAM=$bin/ist
"$bin/python" -m pytest -q -rs -p no:cacheprovider "$here"/../python/test_{jax,mujoco,mujoco_models}.py
"$bin/python" - <<'END'
import ist, trimesh
assert abs(ist.bake(trimesh.creation.box((1, 2, 3)), max_spheres=100).volume - 6) < 1e-9
assert len(ist.from_trimesh(trimesh.creation.icosphere()).triangles) == 1280
END
