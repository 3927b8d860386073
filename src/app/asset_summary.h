#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include <ist/tree_view.h>

namespace ist::app {

/// The header of an asset, lengths and volumes in the mesh's own unit, for a person.
std::string describe_asset(const TreeView& tree);

/// The same, every field with all its digits.
nlohmann::ordered_json asset_json(const TreeView& tree);

}  // namespace ist::app
