#include "packing/grids/host_grid.h"

#include <ist/types.h>
#include <algorithm>
#include <atomic>

#include "base/thread_arena.h"
#include "packing/grids/distance_grid.h"
#include "packing/grids/local_winding.h"

namespace ist::packing {
namespace {

/// Adds, and returns the previous value.
template <class T>
T add(T& to, T value) {
  return std::atomic_ref<T>(to).fetch_add(value, std::memory_order_relaxed);
}

template <class Visit>
void for_rows(const CellRange& range, const Visit& visit) {
  for (int k = range.lo[2]; k <= range.hi[2]; ++k)
    for (int j = range.lo[1]; j <= range.hi[1]; ++j) visit(j, k);
}

}  // namespace

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
    for_each_index(0, static_cast<std::size_t>(grid_lines(layout_, axis)), 64, [&](std::size_t n) {
      sweep_line(field.data(), grid_line(layout_, axis, static_cast<int>(n)));
    });
  for_active([&](const CellRecord& r, std::uint32_t& word) {
    word = DistanceGrid::slot(word) | std::uint32_t{field[r.cell]} << 24;
  });
}

HostGrid::HostGrid(const MeshView& mesh) : mesh_(mesh), triangles_(mesh.triangle_count) {
  GridScene scene;
  scene.corners = mesh.triangles;
  scene.vertices = mesh.vertices;
  for_each_index(0, triangles_.size(), 256, [&](std::size_t t) {
    const Corners c = corners_of(scene, static_cast<std::uint32_t>(t));
    triangles_[t] = make_grid_triangle(c.p[0], c.p[1], c.p[2]);
  });
}

GridScene HostGrid::scene(const std::vector<Sphere>& spheres) const {
  GridScene scene;
  scene.grid = {layout_,
                words_.data(),
                keys_.empty() ? nullptr : keys_.data(),
                static_cast<std::uint32_t>(keys_.empty() ? 0 : keys_.size() - 1),
                records_.data(),
                triangle_lists_.data(),
                sphere_lists_.data()};
  scene.triangles = triangles_.data();
  scene.corners = mesh_.triangles;
  scene.vertices = mesh_.vertices;
  scene.spheres = spheres.data();
  return scene;
}

std::size_t HostGrid::bytes() const {
  return 4 * (words_.size() + keys_.size() + triangle_lists_.size() + sphere_lists_.size()) +
         sizeof(CellRecord) * records_.size();
}

void HostGrid::build(const GridLayout& layout, const std::vector<Sphere>& spheres) {
  layout_ = layout;
  keys_.clear();
  std::vector<std::uint32_t> counts(cells());
  std::vector<std::int32_t> windings(cells());
  count_triangles(counts, windings);
  classify(counts, windings);
  cover(spheres, 0);
  records_.clear();
  triangle_lists_.clear();
  std::uint32_t listed = 0;
  for (std::uint32_t cell = 0; cell < layout_.count(); ++cell) {
    if (words_[cell] == DistanceGrid::kInactive) continue;
    if (records_.size() >= DistanceGrid::kMostActive)
      throw Error("packing: more than 16 million active grid cells: set a smaller grid resolution");
    words_[cell] = static_cast<std::uint32_t>(records_.size());
    records_.push_back({cell, listed, counts[cell], 0, 0, windings[cell]});
    listed += counts[cell];
  }
  active_ = records_.size();
  triangle_lists_.resize(listed);
  fill_triangle_lists();
  hash_words();
  list_spheres(spheres);
  measure_distances();
}

void HostGrid::update(const std::vector<Sphere>& spheres, std::size_t first_new) {
  cover(spheres, first_new);
  drop_inactive();
  list_spheres(spheres);
  measure_distances();
}

/// Counts the triangles that meet each cell, and their terms of the winding number along its row's
/// centre line.
void HostGrid::count_triangles(std::vector<std::uint32_t>& counts,
                               std::vector<std::int32_t>& crossings) const {
  const GridScene mesh = scene({});
  for_each_index(0, triangles_.size(), 64, [&](std::size_t t) {
    const Corners corners = corners_of(mesh, static_cast<std::uint32_t>(t));
    const TriangleCells cells = cells_of(layout_, corners);
    for_rows(cells.range(), [&](int j, int k) {
      int first = kNoCell;
      for (int i = cells.range().lo[0]; i <= cells.range().hi[0]; ++i) {
        if (!cells.meets(layout_, i, j, k)) continue;
        if (first == kNoCell) first = i;
        add(counts[layout_.id(i, j, k)], 1u);
      }
      const int crossing = row_crossing(layout_, corners, j, k);
      if (crossing != 0 && first != kNoCell) add(crossings[layout_.id(first, j, k)], crossing);
    });
  });
}

/// Marks outside cells as inactive; turns crossings into windings for the records.
void HostGrid::classify(const std::vector<std::uint32_t>& counts,
                        std::vector<std::int32_t>& windings) {
  words_.assign(cells(), 0);
  for_each_index(0, static_cast<std::size_t>(layout_.n[1]) * static_cast<std::size_t>(layout_.n[2]),
                 16, [&](std::size_t row) {
                   const std::size_t first = row * static_cast<std::size_t>(layout_.n[0]);
                   std::int32_t winding = 0, last = 0;
                   for (std::size_t c = first; c < first + static_cast<std::size_t>(layout_.n[0]);
                        ++c) {
                     const std::int32_t crossing = windings[c];
                     winding += crossing;
                     if (counts[c] == 0) {
                       last = winding;
                       if (winding < 1) words_[c] = DistanceGrid::kInactive;
                     }
                     windings[c] = last;
                   }
                 });
}

/// Deactivates cells wholly inside new spheres.
void HostGrid::cover(const std::vector<Sphere>& spheres, std::size_t first_new) {
  for_each_index(0, spheres.size() - first_new, 4, [&](std::size_t n) {
    const Sphere& s = spheres[first_new + n];
    const CellRange range = sphere_range(layout_, s);
    for_rows(range, [&](int j, int k) {
      for_sphere_row(layout_, s, range, j, k, true, [&](std::uint32_t cell, bool covered) {
        if (!covered) return;
        const std::uint32_t place = place_of(cell);
        if (place < words_.size()) words_[place] = DistanceGrid::kInactive;
      });
    });
  });
}

std::uint32_t HostGrid::place_of(std::uint32_t cell) const {
  if (keys_.empty()) return cell;
  const auto mask = static_cast<std::uint32_t>(keys_.size() - 1);
  for (std::uint32_t at = DistanceGrid::hashed(cell) & mask;; at = (at + 1) & mask) {
    if (keys_[at] == cell) return at;
    if (keys_[at] == DistanceGrid::kEmptyKey) return static_cast<std::uint32_t>(words_.size());
  }
}

void HostGrid::fill_triangle_lists() {
  const GridScene mesh = scene({});
  std::vector<std::uint32_t> filled(records_.size());
  for_each_index(0, triangles_.size(), 64, [&](std::size_t t) {
    const TriangleCells cells = cells_of(layout_, corners_of(mesh, static_cast<std::uint32_t>(t)));
    for_rows(cells.range(), [&](int j, int k) {
      for (int i = cells.range().lo[0]; i <= cells.range().hi[0]; ++i) {
        if (!cells.meets(layout_, i, j, k)) continue;
        const std::uint32_t slot = words_[layout_.id(i, j, k)];
        triangle_lists_[records_[slot].triangles + add(filled[slot], 1u)] =
            static_cast<std::uint32_t>(t);
      }
    });
  });
}

/// Frees the records of inactive cells once they are many, and compacts the rest.
void HostGrid::drop_inactive() {
  const auto active = [this](const CellRecord& r) {
    return words_[place_of(r.cell)] != DistanceGrid::kInactive;
  };
  active_ = static_cast<std::size_t>(std::count_if(records_.begin(), records_.end(), active));
  if (8 * (records_.size() - active_) < records_.size()) return;
  std::vector<CellRecord> kept;
  kept.reserve(active_);
  for (const CellRecord& r : records_) {
    if (!active(r)) continue;
    words_[place_of(r.cell)] = static_cast<std::uint32_t>(kept.size());
    kept.push_back(r);
  }
  records_.swap(kept);
  hash_words();
}

/// Replaces the words by a hash table if that is much smaller (kHashBelow).
void HostGrid::hash_words() {
  if (!hash_pays(layout_.count(), records_.size())) return;
  std::size_t size = hash_size(records_.size());
  keys_.assign(size, DistanceGrid::kEmptyKey);
  std::vector<std::uint32_t>(size, DistanceGrid::kInactive).swap(words_);
  for (std::size_t slot = 0; slot < records_.size(); ++slot) {
    auto at = static_cast<std::size_t>(DistanceGrid::hashed(records_[slot].cell)) & (size - 1);
    while (keys_[at] != DistanceGrid::kEmptyKey) at = (at + 1) & (size - 1);
    keys_[at] = records_[slot].cell;
    words_[at] = static_cast<std::uint32_t>(slot);
  }
}

void HostGrid::list_spheres(const std::vector<Sphere>& spheres) {
  for (CellRecord& r : records_) r.sphere_count = 0;
  const auto for_listed = [&](const auto& visit) {
    for_each_index(0, spheres.size(), 16, [&](std::size_t n) {
      const CellRange range = sphere_range(layout_, spheres[n]);
      for_rows(range, [&](int j, int k) {
        for_sphere_row(layout_, spheres[n], range, j, k, false, [&](std::uint32_t cell, bool) {
          const std::uint32_t place = place_of(cell);
          if (place >= words_.size() || words_[place] == DistanceGrid::kInactive) return;
          visit(records_[DistanceGrid::slot(words_[place])], static_cast<std::uint32_t>(n));
        });
      });
    });
  };
  for_listed([](CellRecord& r, std::uint32_t) { add(r.sphere_count, 1u); });
  std::uint32_t listed = 0;
  for (CellRecord& r : records_) {
    r.spheres = listed;
    listed += r.sphere_count;
    r.sphere_count = 0;
  }
  std::vector<std::uint32_t>(listed).swap(sphere_lists_);
  for_listed([&](CellRecord& r, std::uint32_t sphere) {
    sphere_lists_[r.spheres + add(r.sphere_count, 1u)] = sphere;
  });
}

}  // namespace ist::packing
