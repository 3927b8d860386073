#!/usr/bin/env bash
# Expected: a compiler cache knows all that changes nvcc's output. ccache 4.7.5 (Debian's) ignores NVCC_APPEND_FLAGS, from which
# nvcc 13.0 takes flags: after a build with --use_fast_math there, one without gets its object.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
nvcc=${NVCC:-$root/build-cuda-toolkit/nvidia/cu13/bin/nvcc}  # ./dev setup --cuda
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
chmod 755 .
apt-get download -qq ccache=4.8+really4.7.5-1 libhiredis0.14=0.14.1-3 2>/dev/null
for package in *.deb; do dpkg -x "$package" tools; done
LD_LIBRARY_PATH=$(dirname "$(find "$PWD/tools" -name 'libhiredis.so*' | head -1)") && export LD_LIBRARY_PATH
export CCACHE_DIR=$folder/cache
echo 'extern "C" __global__ void roots(float* x) { x[threadIdx.x] = sqrtf(x[threadIdx.x]); }' >roots.cu
options=(-arch=compute_90 -compress-mode=none)  # PTX, to be read in the object
compiled() { # compiled NAME FLAGS-OF-THE-ENVIRONMENT
  NVCC_APPEND_FLAGS=$2 tools/usr/bin/ccache "$nvcc" "${options[@]}" -c roots.cu -o "$1.o"
}
compiled fast --use_fast_math
compiled plain ''
"$nvcc" "${options[@]}" -c roots.cu -o true.o
found=$(for object in fast plain true; do echo "$object $(grep -aoE 'sqrt\.[a-z.]+f32' $object.o | head -1)"; done)
echo "$found"
[[ $found == "fast sqrt.approx.ftz.f32"$'\n'"plain sqrt.approx.ftz.f32"$'\n'"true sqrt.rn.f32" ]]
