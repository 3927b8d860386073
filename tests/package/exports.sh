#!/bin/sh
# exports.sh LIBRARY… : what shared libraries show is ist's public interface and nothing else.
set -eu
for library; do
  names=$(nm -D --defined-only -C "$library" | sed 's/^[0-9a-f]* *[A-Za-z] //')
  # Functions of C, and of C++ what the public headers declare: names of one or two levels, and of
  # types what an exception or a class to derive from needs.
  others=$(printf '%s\n' "$names" |
    grep -vE '^(typeinfo (name )?for |vtable for )?ist::(detail::kEmptyAsset|([A-Z][A-Za-z]*::)?~?[A-Za-z_]+)(\(|$)' |
    grep -vE '^ist_[a-z_]+$' || true)
  if [ -n "$others" ]; then
    printf '%s shows what is no part of the interface:\n%s\n' "$library" "$others" >&2
    exit 1
  fi
  # Each public function that a header declares is there: of one that is not, this is a sample.
  case $library in
    *ist_query*) wanted='ist::penetration( ist::separation( ist::query( ist::contact_patches(
      ist::TreeView::from_bytes( ist::Workspace::Workspace( ist::version() ist_penetration' ;;
    *) wanted='ist::bake( ist::check( ist::load_mesh( ist::pack( ist::Asset::load(' ;;
  esac
  for name in $wanted; do
    printf '%s\n' "$names" | grep -qF "$name" || { echo "$library lacks $name" >&2; exit 1; }
  done
  echo "$library: $(printf '%s\n' "$names" | wc -l) symbols"
done
