#pragma once

#include <fcntl.h>
#include <ist/query.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>

/// The asset in a file; it stays mapped. Ends the program if there is none.
inline ist::AssetView map_asset(const char* path) {
  const int file = open(path, O_RDONLY);
  struct stat info {};
  ist::AssetView tree;
  if (file < 0 || fstat(file, &info) != 0 || info.st_size == 0) {
    std::fprintf(stderr, "%s: cannot open\n", path);
    std::exit(1);
  }
  const auto size = static_cast<std::size_t>(info.st_size);
  // Read in whole now: a page fault inside the loop would be a disk access.
  void* const memory = mmap(nullptr, size, PROT_READ, MAP_PRIVATE | MAP_POPULATE, file, 0);
  close(file);
  const ist::AssetStatus status =
      memory == MAP_FAILED
          ? ist::AssetStatus::too_short
          : ist::AssetView::from_bytes({static_cast<const std::byte*>(memory), size}, tree);
  if (status != ist::AssetStatus::ok) {
    std::fprintf(stderr, "%s: %s\n", path, describe(status));
    std::exit(1);
  }
  return tree;
}
