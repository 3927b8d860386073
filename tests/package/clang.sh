#!/bin/sh
# clang.sh SOURCE INSTALLED A.ist B.ist
# Programs of another compiler against the shared library: C, where each function is called, and C++.
set -eu
source=$1 installed=$2 a=$3 b=$4
if ! command -v clang-14 >/dev/null || ! command -v clang++-14 >/dev/null; then
  echo "skipped: no clang-14 (./dev setup --fuzz installs it)"
  exit 77
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export PKG_CONFIG_PATH="$installed/lib/pkgconfig"
libdir=$(pkg-config --variable=libdir ist-query)
readelf -p .comment "$libdir/libist_query.so" | grep -q GCC ||
  echo "note: the library itself is not of g++"
clang-14 -std=c11 -Wall -Wextra -pedantic -Werror -fsyntax-only \
  $(pkg-config --cflags ist-query) "$source/tests/c_api/native_rows.c"  # a program of its own
clang-14 -std=c11 -Wall -Wextra -pedantic -Werror \
  $(ls "$source"/tests/c_api/*.c | grep -vE 'native_rows|bake_checks') \
  $(pkg-config --cflags --libs ist-query) "-Wl,-rpath,$libdir" -lm \
  -o "$work/checks"
"$work/checks" "$a" "$b"
"$work/checks" "$b" "$a"
clang++-14 -std=c++20 "$source/examples/engine/engine.cpp" \
  $(pkg-config --cflags --libs ist-query) "-Wl,-rpath,$libdir" -o "$work/engine"
g++ -std=c++20 "$source/examples/engine/engine.cpp" \
  $(pkg-config --cflags --libs ist-query) "-Wl,-rpath,$libdir" -o "$work/engine_of_gcc"
"$work/engine" "$a" "$b" >"$work/one"
"$work/engine_of_gcc" "$a" "$b" >"$work/other"
cmp "$work/one" "$work/other"
