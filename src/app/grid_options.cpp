#include "app/grid_options.h"

#include "app/number_options.h"
#include "app/text.h"

namespace ist::app {
namespace {

constexpr unsigned kMostCells = 1024;  ///< on a side: what the library takes
constexpr int kMostRefinements = 10;

/// An option that some modes have no use for.
struct ModeOption {
  const char* name;
  bool set;   ///< to another value than its automatic one
  bool used;  ///< by the mode
  const char* users;
};

}  // namespace

void add_grid_options(CLI::App* command, std::string& mode, GridSettings& grids) {
  command->add_option("--grid", mode, "How space is searched")
      ->check(CLI::IsMember({"banded", "uniform", "explicit", "implicit", "hybrid"}))
      ->capture_default_str();
  add_whole(command, "--grid-resolution", grids.resolution,
            "Cells on the longest side of the fixed grid (uniform, implicit), or of hybrid's first "
            "distance grid; 0 = automatic",
            0u, kMostCells);
  add_whole(command, "--grid-start", grids.start,
            "Cells on the longest side of the first grid of prototypes (not banded); 0 = automatic",
            0u, kMostCells);
  add_whole(command, "--grid-refinements", grids.refinements,
            "How often that grid is split in 8 (explicit, implicit, hybrid); -1 = automatic", -1,
            kMostRefinements);
  add_whole(command, "--grid-rounds", grids.rounds_per_level,
            "Rounds before each split (explicit, implicit, hybrid); 0 = automatic");
}

void refuse_idle_options(const PackingSettings& settings) {
  const GridMode mode = settings.grid;
  const GridSettings& grids = settings.grids;
  const bool refined = mode == GridMode::explicit_refinement ||
                       mode == GridMode::implicit_refinement || mode == GridMode::hybrid;
  const ModeOption options[] = {
      {"--epsilon", settings.epsilon != 0, mode == GridMode::banded, "banded"},
      {"--grid-resolution", grids.resolution != 0,
       mode != GridMode::banded && mode != GridMode::explicit_refinement,
       "uniform, implicit and hybrid"},
      {"--grid-start", grids.start != 0, mode != GridMode::banded,
       "uniform, explicit, implicit and hybrid"},
      {"--grid-refinements", grids.refinements >= 0, refined, "explicit, implicit and hybrid"},
      {"--grid-rounds", grids.rounds_per_level != 0, refined, "explicit, implicit and hybrid"},
  };
  for (const ModeOption& option : options)
    if (option.set && !option.used)
      throw CLI::ValidationError(option.name, std::string("has no effect with --grid ") +
                                                  name_of(mode) + ", only with " + option.users);
  if (mode == GridMode::uniform && grids.resolution != 0 && grids.start != 0)
    throw CLI::ValidationError(
        "--grid-start", "has no effect with --grid uniform where --grid-resolution is given");
}

}  // namespace ist::app
