#!/bin/sh
# The Python package as users get it: by pip into an environment of its own, without a network, and
# by cmake --install. usage: python.sh SOURCE BUILD PYTHON FOLDER
set -eu
source=$1 build=$2 python=$3 folder=$4
"$python" -c 'import setuptools, wheel, pip, venv, numpy' 2>/dev/null || {
  echo "no pip, venv, setuptools or wheel for $python: ./dev setup"
  exit 77
}
rm -rf "$folder"
mkdir -p "$folder"
cp -r "$source/python" "$folder/python"   # pip leaves its traces beside setup.py
mkdir -p "$folder/include/ist"
cp "$source/include/ist/version.h" "$folder/include/ist"
"$python" -m venv --system-site-packages "$folder/venv"
IST_BUILD=$build "$folder/venv/bin/pip" install --quiet --no-build-isolation --no-index \
  --disable-pip-version-check "$folder/python"
cmake --install "$build" --component python --prefix "$folder/installed" >"$folder/installed.log"
# To see that it is complete, and needs nothing of the build.
ask='import ist, os, sys
cube = ist.bake(ist.close_mesh(ist.sample_mesh("cube")), max_spheres=50)
assert ist.penetration(cube, cube, [1, 0, 0, 0, 0.1, 0, 0]).volume > 0
folder = os.path.dirname(ist.__file__)
assert folder.startswith(sys.argv[1]), folder
assert {"py.typed", "__init__.pyi", "torch.py"} <= set(os.listdir(folder))'
cd "$folder"
"$folder/venv/bin/python" -c "$ask" "$folder/venv"
PYTHONPATH=$folder/installed/lib/python3/dist-packages "$python" -c "$ask" "$folder/installed"
