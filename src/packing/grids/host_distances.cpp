#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include "packing/grids/discrete_distance.h"
#include "packing/grids/host_grid.h"

namespace ist::packing {

void HostGrid::measure_distances() {
  std::vector<std::uint8_t> field(cells(), kInactiveCell);
  const auto for_active = [this](const auto& visit) {
    for (const CellRecord& r : records_) {
      std::uint32_t& word = words_[place_of(r.cell)];
      if (word != DistanceGrid::kInactive) visit(r, word);
    }
  };
  for_active([&](const CellRecord& r, std::uint32_t) { field[r.cell] = start_distance(r); });
  for (int axis = 0; axis < 3; ++axis)
    oneapi::tbb::parallel_for(oneapi::tbb::blocked_range<int>(0, grid_lines(layout_, axis), 64),
                              [&](const oneapi::tbb::blocked_range<int>& lines) {
                                for (int n = lines.begin(); n != lines.end(); ++n)
                                  sweep_line(field.data(), grid_line(layout_, axis, n));
                              });
  for_active([&](const CellRecord& r, std::uint32_t& word) {
    word = DistanceGrid::slot(word) | std::uint32_t{field[r.cell]} << 24;
  });
}

}  // namespace ist::packing
