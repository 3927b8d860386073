#pragma once

#include <ist/asset.h>
#include <nlohmann/json.hpp>
#include <optional>

namespace ist {

/// A readable description of an asset's header, lengths and volumes in the mesh's own unit.
std::string describe_asset(const AssetView& tree);

/// The same as JSON, every field with all its digits.
nlohmann::ordered_json asset_json(const AssetView& tree);

/// "the mesh counts 0.2 u³, 0.3 % of the volume, more than once: it is not kept, and exact queries
/// are not answered"; "" without such an overlap.
std::string describe_counted_twice(const AssetView& tree);

/// "target 1 % at 0.1 % overlap: met, 0.84 % measured against the worst partner, edge, of 170 poses
/// in all", or missed and why; "" if no error was requested.
std::string describe_target(const AssetView& tree);

/// If an asset's spheres are too coarse for thin parts of the solid, the approximate sufficient
/// number; nothing if they cover enough. As long as spheres are as wide as the walls, each covers
/// as much as the one before; once the walls are full, later spheres are smaller. So the last
/// spheres of the asset determine the count, with a margin.
std::optional<std::uint64_t> enough_spheres(const AssetView& tree);

/// "the spheres are too coarse for thin parts: 19 % of the solid is covered; about 60,000 spheres
/// would do", or that no number would; "" if they are fine enough.
std::string describe_coarseness(const AssetView& tree);

}  // namespace ist
