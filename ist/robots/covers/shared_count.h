#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <vector>

namespace ist {

/// Largest protrusion by count of spheres, of the counts that were tried; at least one.
using TriedCounts = std::map<std::size_t, double>;

/// The largest protrusion of so many spheres: the least one that was tried with as many or fewer,
/// else an estimate between and beyond the counts tried.
double estimated_protrusion(const TriedCounts& tried, std::size_t count);

/// Counts of at least 1 whose sum, `copies` times each, is at most `total`, so that the largest
/// estimated protrusion is as small as possible, then the second largest, and so on.
/// `total` ≥ the sum of `copies`.
std::vector<std::size_t> share_out(std::span<const TriedCounts> tried,
                                   std::span<const std::size_t> copies, std::size_t total);

}  // namespace ist
