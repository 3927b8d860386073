#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <ist/tree_view.h>

namespace ist::app {

/// Of an asset whose spheres are too coarse for thin parts of the solid, about how many would do.
/// Nothing where they cover enough.
///
/// As long as spheres are as wide as the walls, each covers as much as the one before; once these
/// are full, later ones are smaller. So the count is what the last spheres of the asset say, with
/// room for that.
std::optional<std::uint64_t> enough_spheres(const TreeView& tree);

/// "the spheres are too coarse for thin parts: 19 % of the solid is covered; about 60,000 spheres
/// would do"; "" where they are not.
std::string describe_coarseness(const TreeView& tree);

}  // namespace ist::app
