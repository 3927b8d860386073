#pragma once

#include <ist/asset.h>
#include <CLI/CLI.hpp>
#include <optional>

#include "library/summary.h"

namespace ist::app {

/// Options of `ist bake` that only a manifest uses.
struct LibraryOptions {
  std::string manifest, cache, shard;
  unsigned jobs = 0;
  std::optional<std::uint64_t> memory, cache_size;
  bool remove_stale = false, list = false, lines = false;
};

void add_library_options(CLI::App* command, LibraryOptions& options);

struct LibraryRun {
  const LibraryOptions& library;
  const std::string& output;  ///< folder
  const std::string& device;
  unsigned threads;
  bool json, quiet;
};

/// Bakes the manifest's assets. Throws Error, and ExitCode: 1 if an asset failed, 2 if the manifest
/// has mistakes, 130 after Ctrl-C.
void run_library(const LibraryRun& run);

/// Warnings about a baked asset: a missed target, coarse spheres, overlapping parts.
std::vector<std::string> warnings_of(const AssetView& tree);

/// Prints to stdout, as JSON or as a table; nothing if `quiet` and no JSON. `failed`: only assets
/// that are not done are listed; all are counted.
void print_summary(const Summary& summary, bool json, bool quiet, bool failed = false);

}  // namespace ist::app
