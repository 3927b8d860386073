#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include <ist/packing.h>

namespace ist::app {

/// Adds --grid, by name, and the --grid-… options that shape the grids.
void add_grid_options(CLI::App* command, std::string& mode, GridSettings& grids);

/// Throws (exit code 2) if an option is set that the mode has no use for: it would change nothing
/// but the asset's hash.
void refuse_idle_options(const PackingSettings& settings);

}  // namespace ist::app
