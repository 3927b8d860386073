#include "mesh/equal_points.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>

#include "numerics/hashing.h"

namespace ist {
namespace {

constexpr std::size_t kDrawers = 256;  ///< by the hash's highest bits
constexpr std::size_t kChunk = 16'384;

struct Entry {
  std::uint32_t hash, point;
};

std::uint64_t hash_of(const Eigen::Vector3d& p) {
  std::uint64_t hash = 0;
  for (const double x : p)
    hash = mixed(hash ^ std::bit_cast<std::uint64_t>(x + 0.0));  // −0 + 0 = 0
  return hash;
}

/// The entries of a drawer come in the order of their points: the first of equal ones is kept.
void find_first(const std::vector<Eigen::Vector3d>& points, const Entry* const entries,
                const std::size_t count, std::vector<std::uint32_t>& first) {
  constexpr std::uint32_t kFree = UINT32_MAX;
  const std::size_t mask = std::bit_ceil(2 * count + 1) - 1;
  std::vector<Entry> table(mask + 1, Entry{0, kFree});
  for (std::size_t i = 0; i < count; ++i) {
    const Entry& entry = entries[i];
    std::size_t at = entry.hash & mask;
    while (table[at].point != kFree &&
           !(table[at].hash == entry.hash && points[table[at].point] == points[entry.point]))
      at = (at + 1) & mask;
    if (table[at].point == kFree) table[at] = entry;
    first[entry.point] = table[at].point;
  }
}

}  // namespace

std::vector<std::uint32_t> first_equal(const std::vector<Eigen::Vector3d>& points,
                                       const std::vector<std::uint8_t>& used) {
  // Chunks of points count what they have for each drawer, then put it there in order.
  const std::size_t chunks = (points.size() + kChunk - 1) / kChunk;
  std::vector<std::uint64_t> hashes(points.size());
  std::vector<std::array<std::uint32_t, kDrawers>> place(chunks);
  const auto for_each_used = [&](const auto& visit) {
    tbb::parallel_for(std::size_t{0}, chunks, [&](const std::size_t c) {
      for (std::size_t p = c * kChunk; p < std::min((c + 1) * kChunk, points.size()); ++p)
        if (used[p] != 0) visit(c, p);
    });
  };
  for (auto& counts : place) counts.fill(0);
  for_each_used([&](const std::size_t c, const std::size_t p) {
    hashes[p] = hash_of(points[p]);
    ++place[c][hashes[p] >> 56];
  });
  std::array<std::uint32_t, kDrawers + 1> begin{};
  std::uint32_t sum = 0;
  for (std::size_t d = 0; d < kDrawers; ++d) {
    begin[d] = sum;
    for (auto& counts : place) {
      const std::uint32_t count = counts[d];
      counts[d] = sum;
      sum += count;
    }
  }
  begin[kDrawers] = sum;
  std::vector<Entry> entries(sum);
  for_each_used([&](const std::size_t c, const std::size_t p) {
    entries[place[c][hashes[p] >> 56]++] = {static_cast<std::uint32_t>(hashes[p]),
                                            static_cast<std::uint32_t>(p)};
  });
  std::vector<std::uint32_t> first(points.size());
  tbb::parallel_for(std::size_t{0}, kDrawers, [&](const std::size_t d) {
    find_first(points, entries.data() + begin[d], begin[d + 1] - begin[d], first);
  });
  return first;
}

}  // namespace ist
