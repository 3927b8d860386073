#!/bin/sh
# The Python package as cmake --install leaves it. usage: python.sh BUILD PYTHON FOLDER
set -eu
build=$1 python=$2 folder=$3
rm -rf "$folder"
cmake --install "$build" --component python --prefix "$folder/installed" >/dev/null
cd "$folder"
# To see that it is complete, and needs nothing of the build.
PYTHONPATH=$folder/installed/lib/python3/dist-packages "$python" -c 'import ist, os, sys
cube = ist.bake(ist.close_mesh(ist.sample_mesh("cube")), max_spheres=50)
assert ist.penetration(cube, cube, [1, 0, 0, 0, 0.1, 0, 0]).volume > 0
folder = os.path.dirname(ist.__file__)
assert folder.startswith(sys.argv[1]), folder
assert {"py.typed", "__init__.pyi", "torch.py"} <= set(os.listdir(folder))' "$folder/installed"
