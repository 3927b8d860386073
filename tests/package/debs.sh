#!/bin/sh
# debs.sh SOURCE BUILD WORK A.ist B.ist
# The Debian packages: made, installed by dpkg into a root that holds nothing but the files of
# the packages that they depend on (copied from this system, where those are installed), run there by
# chroot, and removed. What they forget to depend on is not there, and the programs do not start.
# libist-dev is unpacked beside that root: a C program is built with it and runs inside.
set -eu
source=$1 build=$2 work=$3 a=$4 b=$5
for tool in dpkg-deb dpkg-shlibdeps chroot; do
  command -v $tool >/dev/null || { echo "skipped: no $tool"; exit 77; }
done
if [ "$(id -u)" != 0 ]; then
  unshare -r true 2>/dev/null || { echo "skipped: neither root nor user namespaces"; exit 77; }
  exec unshare -r "$0" "$@"
fi
rm -rf "$work"
mkdir -p "$work"
(cd "$work" && cpack -D CPACK_DEBIAN_COMPRESSION_TYPE=gzip --config "$build/CPackConfig.cmake" \
  -B "$work/debs" >cpack.log 2>&1) ||  # xz would take ten times as long
  { cat "$work/cpack.log"; exit 1; }
arch=$(dpkg --print-architecture)
deb() { ls "$work"/debs/"$1"_*_"$arch".deb; }
for package in libist libist-dev libist-bullet-dev ist; do
  echo "$package depends on $(dpkg-deb -f "$(deb $package)" Depends)"
done
dpkg-deb -f "$(deb libist-dev)" Depends | grep -q '^libist (= '
dpkg-deb -f "$(deb libist-bullet-dev)" Depends | grep -q '^libist-dev (= .*, libbullet-dev$'
dpkg-deb -c "$(deb libist-bullet-dev)" | grep -q 'include/ist/bullet/contacts.h$'
if dpkg-deb -c "$(deb libist-dev)" | grep -q bullet; then exit 1; fi
if dpkg-deb -f "$(deb ist)" Depends | grep -q libist; then exit 1; fi

dpkg-query -W -f '${binary:Package} ,${Provides},\n' | sed 's/ *([^)]*)//g' >"$work/provided"
# Names of all packages that those named depend on, as they are installed here.
closure() {
  seen=" " queue="$*"
  while [ -n "$queue" ]; do
    set -- $queue
    package=$1
    shift
    queue="$*"
    case $seen in *" $package "*) continue ;; esac
    seen="$seen$package "
    queue="$queue $(depends "$(dpkg-query -W -f '${Depends}, ${Pre-Depends}' "$package")")"
  done
  echo "$seen"
}
# The installed package of that name, or one that provides it, as dpkg knows it: pkg or pkg:arch.
installed() {
  for name in "$1:$arch" "$1"; do
    case $(dpkg-query -W -f '${db:Status-Abbrev}' "$name" 2>/dev/null) in
      ii*) dpkg-query -W -f '${binary:Package}\n' "$name" && return ;;
    esac
  done
  sed -n "s/^\([^ ]*\) .*[ ,]$1[ ,].*/\1/p" "$work/provided" | head -n 1
}
# The first installed alternative of a list of dependencies.
depends() {
  printf '%s\n' "$1" | tr ',' '\n' | while read -r alternatives; do
    printf '%s\n' "$alternatives" | tr '|' '\n' | sed 's/ *\([^ (:]*\).*/\1/' | while read -r name; do
      found=$([ -z "$name" ] || installed "$name")
      if [ -n "$found" ]; then echo "$found"; break; fi
    done
  done
}

root=$work/root
mkdir -p "$root/usr/lib" "$root/usr/lib64" "$root/usr/bin" "$root/usr/sbin" "$root/tmp" \
  "$root/var/lib/dpkg/info" "$root/var/lib/dpkg/updates"
for folder in lib lib64 bin sbin; do ln -s usr/$folder "$root/$folder"; done
wanted=$(depends "$(dpkg-deb -f "$(deb libist)" Depends), $(dpkg-deb -f "$(deb ist)" Depends)")
# A shell and ldconfig are on every Debian system, and no package names them.
for name in $(closure $wanted $(installed dash) $(installed libc-bin)); do
  dpkg-query -s "$name" >>"$root/var/lib/dpkg/status"
  echo >>"$root/var/lib/dpkg/status"
  cp /var/lib/dpkg/info/"$name".list "$root/var/lib/dpkg/info" 2>/dev/null ||
    cp /var/lib/dpkg/info/"${name%%:*}".list "$root/var/lib/dpkg/info"
  dpkg-query -L "$name" | while read -r file; do
    if [ -f "$file" ] || [ -L "$file" ]; then
      case $file in */doc/* | */locale/* | */man/*) ;; *) echo "${file#/}" ;; esac
    fi
  done >>"$work/files"
done
tar -C / -c -T "$work/files" | tar -C "$root" -x --keep-directory-symlink

dpkg --root="$root" -i "$(deb libist)" "$(deb ist)"
mkdir "$work/dev"
dpkg-deb -x "$(deb libist)" "$work/dev"
dpkg-deb -x "$(deb libist-dev)" "$work/dev"
PKG_CONFIG_PATH=$work/dev/usr/lib/pkgconfig
export PKG_CONFIG_PATH
cc -std=c11 "$source/examples/c/c.c" $(pkg-config --cflags --libs ist-query) -o "$root/tmp/c"
cp "$a" "$root/tmp/a.ist"
cp "$b" "$root/tmp/b.ist"
in_root() { chroot "$root" "$@"; }
in_root /usr/bin/ist --version
for file in man/man1/ist.1 man/man1/ist-bake.1 bash-completion/completions/ist \
  zsh/vendor-completions/_ist fish/vendor_completions.d/ist.fish; do
  [ -s "$root/usr/share/$file" ] || [ -s "$root/usr/share/$file.gz" ] || {
    echo "no $file" >&2
    exit 1
  }
done
in_root /usr/bin/ist sample cube -o /tmp/cube.obj
in_root /usr/bin/ist bake /tmp/cube.obj -o /tmp/cube.ist --spheres 100 --device cpu --quiet
in_root /usr/bin/ist query /tmp/cube.ist /tmp/a.ist --pose 1,0,0,0,0.1,0,0
in_root /tmp/c /tmp/a.ist /tmp/b.ist

# Without libist the program that needs it does not start, and ist still does.
dpkg --root="$root" --purge libist
if in_root /tmp/c /tmp/a.ist /tmp/b.ist 2>/dev/null; then exit 1; fi
in_root /usr/bin/ist --version
dpkg --root="$root" --purge ist
left=$(find "$root/usr" -name 'ist' -o -name 'libist*')
[ -z "$left" ] || { echo "left behind: $left"; exit 1; }
rm -rf "$root" "$work/dev"
