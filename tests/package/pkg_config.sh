#!/bin/sh
# pkg_config.sh SOURCE CXX CC WHOLE STATIC_ONLY A.ist B.ist MESH MESH
# Programs built by pkg-config alone: WHOLE is an install tree with both kinds of libraries,
# STATIC_ONLY one of ist::query that has no shared one.
set -eu
source=$1 cxx=$2 cc=$3 whole=$4 static_only=$5 a=$6 b=$7
shift 7
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

use() { export PKG_CONFIG_PATH="$1/lib/pkgconfig:$1/lib/$(cc -dumpmachine)/pkgconfig"; }

use "$whole"
version=$(sed -n 's/^#define IST_VERSION_[A-Z]* \([0-9]*\)$/\1/p' \
  "$source/include/ist/version.h" | paste -sd.)
[ "$(pkg-config --modversion ist-query)" = "$version" ]
[ "$(pkg-config --modversion ist)" = "$version" ]
case $(pkg-config --libs ist-query) in *hwy*) echo "-lhwy is the static library's" >&2; exit 1 ;; esac
rpath="-Wl,-rpath,$(pkg-config --variable=libdir ist-query)"
"$cxx" -std=c++20 "$source/examples/engine/engine.cpp" \
  $(pkg-config --cflags --libs ist-query) "$rpath" -o "$work/engine"
"$work/engine" "$a" "$b"
"$cc" -std=c11 -Wall -Wextra -pedantic -Werror "$source/examples/c/c.c" \
  $(pkg-config --cflags --libs ist-query) "$rpath" -o "$work/c"
"$work/c" "$a" "$b"
# The listing in C of the guide as it stands there.
cp "$a" "$work/bolt.ist"
{
  echo '#include <ist/c.h>'
  echo 'int main(void) {'
  sed -n '/^```c$/,/^```$/p' "$source/docs/user_guide.md" | grep -v '^```'
  echo 'return status != IST_OK || !(overlap.volume > 0); }'
} >"$work/listing.c"
"$cc" -std=c11 -Wall -Wextra -pedantic -Werror "$work/listing.c" \
  $(pkg-config --cflags --libs ist-query) "$rpath" -o "$work/listing"
(cd "$work" && ./listing)
"$cxx" -std=c++20 -c "$source/examples/bake_and_query/bake_and_query.cpp" \
  $(pkg-config --cflags ist) -o "$work/bake_and_query.o"
"$cxx" "$work/bake_and_query.o" $(pkg-config --libs ist) "$rpath" -o "$work/bake_and_query"
"$work/bake_and_query" "$@"
readelf -d "$work/bake_and_query" | grep -q 'libist\.so'

# Bullet in either precision, where it was found.
for bullet in ist-bullet ist-bullet-float64; do
  [ -e "$whole/lib/lib$(echo $bullet | sed s/-/_/).a" ] || continue
  echo '#include <ist/bullet/contacts.h>
    int main() { ist::bullet::Contacts contacts; btTransform at(btQuaternion::getIdentity()); }' \
    >"$work/bullet.cpp"
  "$cxx" -std=c++20 "$work/bullet.cpp" $(pkg-config --cflags --libs $bullet) "$rpath" \
    -o "$work/bullet"
  "$work/bullet"
done

# The static libraries of the same tree, by name.
"$cxx" "$work/bake_and_query.o" -o "$work/bake_and_query" \
  $(pkg-config --static --libs ist | sed 's/-list_query/-l:libist_query.a/; s/-list /-l:libist.a /')
"$work/bake_and_query" "$@"
if readelf -d "$work/bake_and_query" | grep 'libist'; then exit 1; fi

use "$static_only"
"$cc" -std=c11 "$source/examples/c/c.c" $(pkg-config --cflags --libs ist-query) -o "$work/c"
"$work/c" "$a" "$b"

# Its headers need nothing else, and are quiet under warnings; ist::query alone loads a file.
headers=$(pkg-config --variable=includedir ist-query)/ist
for header in "$headers"/*.h; do echo "#include <ist/${header##*/}>"; done >"$work/headers.cpp"
cat >>"$work/headers.cpp" <<'END'
#include <cstdio>
int main(int, char** argv) try {
  return ist::Asset::load(argv[1]).view().sphere_count() > 0 ? 0 : 1;
} catch (const ist::Error& error) {
  return std::puts(error.what()), 2;
}
END
for lacking in bake mesh packing gpu_query gpu_scene query_tbb; do [ ! -e "$headers/$lacking.h" ]; done
"$cxx" -std=c++20 -Wall -Wextra -Wshadow -Wconversion -Werror "$work/headers.cpp" \
  $(pkg-config --cflags --libs ist-query | sed 's/-I\([^ ]*eigen3\)/-isystem \1/') -o "$work/headers"
"$work/headers" "$a"
"$work/headers" none.ist | grep '^none.ist: cannot open'
