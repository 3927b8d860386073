#!/bin/sh
# exports.sh HEADERS LIBRARY… : what shared libraries show is what the headers in the folder HEADERS
# declare, and nothing else.
set -eu
headers=$1
shift
text=$(cat "$headers"/*.h)
declared() { printf '%s\n' "$text" | grep -qE "$1"; }

for library; do
  names=$(nm -D --defined-only -C "$library" | sed 's/^[0-9a-f]* *[A-Za-z] //; s/\[abi:[a-z0-9]*\]//; s/^[a-z]* ist::/ist::/')
  others=$(printf '%s\n' "$names" | sed -E 's/^(typeinfo name|typeinfo|vtable) for //' |
    while read -r name; do
      scope=${name%%(*}
      case $scope in
        *::Impl::*) echo "$name" && continue ;;
        ist::*) ;;
        ist_*) declared "\\b$scope\\(" || echo "$name" && continue ;;
        *) echo "$name" && continue ;;
      esac
      # A class must be defined, a function or constant declared.
      part=$(printf '%s\n' "${scope#ist::}" | sed -E 's/^detail:://; s/[:<].*//')
      case $part in
        k[A-Z]*) declared "\\b$part\\b" || echo "$name" ;;
        [A-Z]*) declared "^ *(class|struct) $part( [^;]*)?(\\{|$)" || echo "$name" ;;
        *) declared "\\b$part\\(" || echo "$name" ;;
      esac
    done)
  if [ -n "$others" ]; then
    printf '%s shows what is no part of the interface:\n%s\n' "$library" "$others" >&2
    exit 1
  fi
  case $library in
    *ist_query*) wanted='ist::penetration( ist::separation( ist::query( ist::contact_patches(
      ist::AssetView::from_bytes( ist::Workspace::Workspace( ist::version() ist::Asset::load( ist_penetration' ;;
    *) wanted='ist::bake( ist::check( ist::load_mesh( ist::pack( ist::Asset::save(' ;;
  esac
  for name in $wanted; do
    printf '%s\n' "$names" | grep -qF "$name" || { echo "$library lacks $name" >&2; exit 1; }
  done
  echo "$library: $(printf '%s\n' "$names" | wc -l) symbols"
done
