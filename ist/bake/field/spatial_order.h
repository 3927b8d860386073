#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace ist {

/// An order of points in which neighbours are near each other: their box is halved across its
/// longest side, again and again, so that every group of 16, 256, … from the start is compact. Ties
/// go by index. The same for any number of threads.
std::vector<std::uint32_t> spatial_order(std::span<const std::array<float, 3>> points);

}  // namespace ist
