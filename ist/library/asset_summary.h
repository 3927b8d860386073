#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include <ist/tree_view.h>

namespace ist::app {

/// The header of an asset, lengths and volumes in the mesh's own unit, for a person.
std::string describe_asset(const TreeView& tree);

/// The same, every field with all its digits.
nlohmann::ordered_json asset_json(const TreeView& tree);

/// "the mesh counts 0.2 u³, 0.3 % of the volume, more than once: it is not kept, and exact queries
/// are not answered"; "" for one that does not.
std::string describe_counted_twice(const TreeView& tree);

/// "target 1 % at 0.1 % overlap: met, 0.84 % measured against the worst partner, edge, of 170 poses
/// in all", or missed and why; "" where no error was asked for.
std::string describe_target(const TreeView& tree);

}  // namespace ist::app
