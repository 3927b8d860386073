#include "packing/grids/host_selection.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <array>
#include <cmath>
#include <unordered_map>

#include "packing/grids/discrete_distance.h"

namespace ist::packing {
namespace {

template <class Work>
void for_each_index(std::size_t count, const Work& work) {
  oneapi::tbb::parallel_for(oneapi::tbb::blocked_range<std::size_t>(0, count, 64),
                            [&](const oneapi::tbb::blocked_range<std::size_t>& range) {
                              for (std::size_t i = range.begin(); i != range.end(); ++i) work(i);
                            });
}

/// Those of `candidates` that `keep(index)` is true for.
template <class Keep>
std::vector<GridCandidate> filtered(const std::vector<GridCandidate>& candidates,
                                    const Keep& keep) {
  std::vector<std::uint8_t> kept(candidates.size());
  for_each_index(candidates.size(), [&](std::size_t i) { kept[i] = keep(i) ? 1 : 0; });
  std::vector<GridCandidate> out;
  for (std::size_t i = 0; i < candidates.size(); ++i)
    if (kept[i] != 0) out.push_back(candidates[i]);
  return out;
}

/// Candidates by size class and place: class c holds radii in [2^(c−1), 2^c) · 2^−kClasses, in
/// cells wide enough that a smaller candidate overlaps none beyond the neighbours of its own cell.
class SizeClasses {
 public:
  explicit SizeClasses(const std::vector<GridCandidate>& candidates) : candidates_(candidates) {
    for (std::uint32_t i = 0; i < candidates.size(); ++i) {
      const int c = class_of(candidates[i].radius);
      used_[static_cast<std::size_t>(c)] = true;
      cells_[key(c, candidates[i].centre, 0, 0, 0)].push_back(i);
    }
  }

  bool outdone(std::size_t index) const {
    const GridCandidate& me = candidates_[index];
    for (int c = class_of(me.radius); c < kClasses; ++c) {
      if (!used_[static_cast<std::size_t>(c)]) continue;
      for (int n = 0; n < 27; ++n) {
        const auto cell = cells_.find(key(c, me.centre, n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1));
        if (cell == cells_.end()) continue;
        for (const std::uint32_t i : cell->second)
          if (goes_before(candidates_[i], me) && overlap(candidates_[i], me)) return true;
      }
    }
    return false;
  }

 private:
  static constexpr int kClasses = 26;
  static int class_of(float radius) {
    int exponent = 0;
    std::frexp(radius, &exponent);  // radius < 2^exponent
    const int c = exponent + kClasses - 2;
    return c < 0 ? 0 : (c >= kClasses ? kClasses - 1 : c);
  }
  static std::uint64_t key(int c, Float3 p, int dx, int dy, int dz) {
    const float width = std::ldexp(2.01f, c - (kClasses - 2));
    const auto along = [&](float x, int d) {
      return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor((x + 4) / width)) +
                                        d) &
             0xFFFFF;
    };
    // Classes below the least one's width would not fit 20 bits; their key only gets coarser lists.
    return mixed(along(p.x, dx) | along(p.y, dy) << 20 | along(p.z, dz) << 40) +
           static_cast<std::uint64_t>(c);
  }

  const std::vector<GridCandidate>& candidates_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cells_;
  std::array<bool, kClasses> used_{};
};

}  // namespace

std::vector<GridCandidate> selected(const GridLayout& layout,
                                    const std::vector<GridCandidate>& candidates) {
  const std::size_t size = hash_size(candidates.size());
  std::vector<std::uint32_t> keys(size, CellTable::kEmpty), values(size);
  for (std::uint32_t i = 0; i < candidates.size(); ++i) {
    std::size_t at = DistanceGrid::hashed(candidates[i].cell) & (size - 1);
    while (keys[at] != CellTable::kEmpty) at = (at + 1) & (size - 1);
    keys[at] = candidates[i].cell;
    values[at] = i;
  }
  const CellTable table{keys.data(), values.data(), static_cast<std::uint32_t>(size - 1)};
  const std::vector<GridCandidate> ahead = filtered(candidates, [&](std::size_t i) {
    return candidates[i].radius > 0 &&
           !outdone_by_neighbour(layout, table, candidates.data(), static_cast<std::uint32_t>(i));
  });
  const SizeClasses classes(ahead);
  return filtered(ahead, [&](std::size_t i) { return !classes.outdone(i); });
}

}  // namespace ist::packing
