#include "bake/mesh/kept_mesh.h"

#include <algorithm>
#include <cmath>

#include "base/elementary.h"
#include "mesh/connectivity/disjoint_sets.h"
#include "mesh/connectivity/item_groups.h"
#include "mesh/geometry/mesh_view.h"
#include "mesh/geometry/triangle_frame.h"

namespace ist {
namespace {

constexpr std::uint32_t kNoVertex = ~0u;

struct Box {
  float low[3], high[3];

  Box() {
    std::fill_n(low, 3, static_cast<float>(2 * kMaxExtent));
    std::fill_n(high, 3, static_cast<float>(-2 * kMaxExtent));
  }
  void add(const double* x) {
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], rounded_down(x[k]));
      high[k] = std::max(high[k], rounded_up(x[k]));
    }
  }
  void add(const Box& box) {
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], box.low[k]);
      high[k] = std::max(high[k], box.high[k]);
    }
  }
};

/// Patches in an order whose groups of 16, 256, … are compact.
std::vector<BlockPatch> patches_in_order(const MeshView& mesh) {
  std::vector<BlockPatch> patches = cut_into_patches(in_floats(mesh));
  std::vector<std::array<float, 3>> middles(patches.size());
  for (std::size_t p = 0; p < patches.size(); ++p) {
    Box box;
    for (const std::uint32_t v : patches[p].vertices) box.add(mesh.vertices + 3 * std::size_t{v});
    for (std::size_t k = 0; k < 3; ++k) middles[p][k] = (box.low[k] + box.high[k]) / 2;
  }
  std::vector<BlockPatch> sorted;
  sorted.reserve(patches.size());
  for (const std::uint32_t p : spatial_order(middles)) sorted.push_back(std::move(patches[p]));
  return sorted;
}

/// Numbers vertices in the order in which blocks use them.
void lay_out_blocks(const MeshView& mesh, const std::vector<BlockPatch>& patches,
                    MeshArrays& arrays) {
  std::vector<std::uint32_t> number(mesh.vertex_count, kNoVertex);
  std::uint32_t used = 0;
  arrays.blocks.resize(patches.size());
  for (std::size_t b = 0; b < patches.size(); ++b) {
    const BlockPatch& patch = patches[b];
    MeshBlock& block = arrays.blocks[b];
    block.triangles = static_cast<std::uint8_t>(patch.triangles.size());
    block.vertices = static_cast<std::uint8_t>(patch.vertices.size());
    for (std::size_t i = 0; i < kWidth; ++i) {
      const std::uint32_t v = patch.vertices[i < patch.vertices.size() ? i : 0];
      if (number[v] == kNoVertex) {
        number[v] = used++;
        for (std::size_t k = 0; k < 3; ++k)
          arrays.vertices.push_back(mesh.vertices[3 * std::size_t{v} + k] + 0.0);  // −0 is 0
      }
      block.vertex[i] = number[v];
    }
    for (std::size_t k = 0; k < 3; ++k) {
      std::fill_n(block.corner[k], kWidth, std::uint8_t{0});
      for (std::size_t i = 0; i < patch.triangles.size(); ++i) {
        block.corner[k][i] =
            patch.place_of(mesh.triangles[3 * std::size_t{patch.triangles[i]} + k]);
      }
    }
    arrays.header.triangle_count += block.triangles;
  }
  arrays.header.vertex_count = used;
}

/// Calls visit(b, other, place) for blocks that share a vertex, with its `place` in block b. At a
/// vertex of so many blocks that each would list all others, only the blocks on both sides of an
/// edge are visited, and one block of each group that this leaves separate.
template <class Visit>
void for_neighbours(const MeshArrays& arrays, const ItemGroups<>& around, const Visit& visit) {
  const auto place_of = [&](std::uint32_t b, std::uint32_t v) {
    const std::uint32_t* const all = arrays.blocks[b].vertex;
    return static_cast<std::uint32_t>(std::find(all, all + kWidth, v) - all);
  };
  const auto both = [&](std::uint32_t b, std::uint32_t other, std::uint32_t v) {
    visit(b, other, place_of(b, v));
    visit(other, b, place_of(other, v));
  };
  const auto is_large = [&](std::uint32_t v) { return around[v].size() > kMostAround; };
  std::vector<std::array<std::uint32_t, 3>> spokes;  // large vertex, the edge's other end, block
  for (std::uint32_t b = 0; b < arrays.blocks.size(); ++b) {
    const MeshBlock& block = arrays.blocks[b];
    for (std::uint32_t i = 0; i < block.vertices; ++i)
      if (!is_large(block.vertex[i]))
        for (const std::uint32_t other : around[block.vertex[i]])
          if (other != b) visit(b, other, i);
    for (std::uint32_t side = 0; side < 3u * block.triangles; ++side) {
      const std::uint32_t v = block.vertex[block.corner[side % 3][side / 3]],
                          w = block.vertex[block.corner[(side + 1) % 3][side / 3]];
      if (is_large(v)) spokes.push_back({v, w, b});
      if (is_large(w)) spokes.push_back({w, v, b});
    }
  }
  std::sort(spokes.begin(), spokes.end());
  for (std::size_t i = 0; i < spokes.size();) {
    const std::uint32_t v = spokes[i][0];
    const auto blocks = around[v];
    DisjointSets groups(blocks.size());
    const auto number = [&](std::uint32_t b) {
      return static_cast<std::uint32_t>(std::lower_bound(blocks.begin(), blocks.end(), b) -
                                        blocks.begin());
    };
    const auto join = [&](std::uint32_t b, std::uint32_t other) {
      both(b, other, v);
      groups.unite(number(b), number(other));
    };
    for (++i; i < spokes.size() && spokes[i][0] == v; ++i)
      if (spokes[i][1] == spokes[i - 1][1] && spokes[i][2] != spokes[i - 1][2])
        join(spokes[i - 1][2], spokes[i][2]);
    for (std::uint32_t k = 1; k < blocks.size(); ++k)
      if (groups.find(k - 1) != groups.find(k)) join(blocks[k - 1], blocks[k]);
  }
}

void find_neighbours(MeshArrays& arrays) {
  const ItemGroups<> around(arrays.header.vertex_count,
                            [&](const auto& visit) {  // blocks, vertices
                              for (std::uint32_t b = 0; b < arrays.blocks.size(); ++b)
                                for (std::uint32_t i = 0; i < arrays.blocks[b].vertices; ++i)
                                  visit(arrays.blocks[b].vertex[i], b);
                            });
  // For each block: the other block, and the index of the vertex.
  std::vector<std::vector<std::pair<std::uint32_t, std::uint32_t>>> found_of(arrays.blocks.size());
  for_neighbours(arrays, around, [&](std::uint32_t b, std::uint32_t other, std::uint32_t place) {
    found_of[b].emplace_back(other, place);
  });
  for (std::uint32_t b = 0; b < arrays.blocks.size(); ++b) {
    MeshBlock& block = arrays.blocks[b];
    std::vector<std::pair<std::uint32_t, std::uint32_t>>& found = found_of[b];
    std::sort(found.begin(), found.end());
    block.first_neighbour = static_cast<std::uint32_t>(arrays.neighbours.size());
    for (std::size_t k = 0; k < found.size(); ++k)
      if (k == 0 || found[k].first != found[k - 1].first)
        arrays.neighbours.push_back(found[k].first * kWidth + found[k].second);
    block.neighbours = static_cast<std::uint32_t>(arrays.neighbours.size()) - block.first_neighbour;
  }
}

Box box_of(const MeshArrays& arrays, const MeshBlock& block) {
  Box box;
  for (std::uint32_t i = 0; i < block.vertices; ++i)
    box.add(arrays.vertices.data() + 3 * std::size_t{block.vertex[i]});
  return box;
}

void find_shells(MeshArrays& arrays) {
  for (MeshBlock& block : arrays.blocks) block.shell = kNoVertex;
  std::vector<std::uint32_t> waiting;
  for (std::uint32_t seed = 0; seed < arrays.blocks.size(); ++seed) {
    if (arrays.blocks[seed].shell != kNoVertex) continue;
    const auto shell = static_cast<std::uint32_t>(arrays.shells.size());
    waiting = {seed};
    arrays.blocks[seed].shell = shell;
    while (!waiting.empty()) {
      const MeshBlock& block = arrays.blocks[waiting.back()];
      waiting.pop_back();
      for (std::uint32_t k = 0; k < block.neighbours; ++k) {
        const std::uint32_t n = arrays.neighbours[block.first_neighbour + k] / kWidth;
        if (arrays.blocks[n].shell != kNoVertex) continue;
        arrays.blocks[n].shell = shell;
        waiting.push_back(n);
      }
    }
    arrays.shells.push_back({seed});
  }
}

void lay_out_boxes(std::vector<Box> below, MeshArrays& arrays) {
  do {
    std::vector<BoxBlock>& level = arrays.boxes.emplace_back((below.size() + kWidth - 1) / kWidth);
    std::vector<Box> around(level.size());
    for (std::size_t i = 0; i < level.size() * kWidth; ++i) {
      const Box box = i < below.size() ? below[i] : Box();
      around[i / kWidth].add(box);
      for (int k = 0; k < 3; ++k) {
        level[i / kWidth].low[k][i % kWidth] = box.low[k];
        level[i / kWidth].high[k][i % kWidth] = box.high[k];
        level[i / kWidth].normal[k][i % kWidth] = 0;
      }
      level[i / kWidth].slab_low[i % kWidth] = box.low[0];
      level[i / kWidth].slab_high[i % kWidth] = box.high[0];
    }
    below = std::move(around);
  } while (below.size() > 1);
}

/// Adds the integrals over a triangle; `p`: corners relative to the reference point.
void add_integrals(const double (&p)[3][3], BoxSums& sums, std::size_t lane) {
  double middle[3], n[3];  // n: ∫ n dA
  area_normal(p[0], p[1], p[2], n);
  for (int k = 0; k < 3; ++k) {
    middle[k] = ((p[0][k] + p[1][k]) + p[2][k]) / 3;
    n[k] /= 2;
  }
  const double height = (middle[0] * n[0] + middle[1] * n[1]) + middle[2] * n[2];
  for (int i = 0; i < 3; ++i) {
    sums.normal[i][lane] += n[i];
    sums.cone[i][lane] += middle[i] * height;  // y · n is constant on a triangle
    for (int k = 0; k < 3; ++k) sums.flux[i][k][lane] += middle[i] * n[k];
  }
  sums.area[lane] += std::sqrt((n[0] * n[0] + n[1] * n[1]) + n[2] * n[2]) * (1 + 1e-12) + 1e-300;
}

/// Sums the triangles of each lane directly: sums of sums would round more.
void find_sums(MeshArrays& arrays) {
  std::size_t span = 1;  // blocks below a lane
  for (const std::vector<BoxBlock>& level : arrays.boxes) {
    std::vector<BoxSums>& sums = arrays.sums.emplace_back(level.size(), BoxSums{});
    for (std::size_t b = 0; b < arrays.blocks.size(); ++b) {
      const std::size_t at = b / span, lane = at % kWidth;
      const BoxBlock& box = level[at / kWidth];
      const MeshBlock& block = arrays.blocks[b];
      for (std::uint32_t t = 0; t < block.triangles; ++t) {
        double p[3][3];
        for (int c = 0; c < 3; ++c)
          for (int k = 0; k < 3; ++k)
            p[c][k] = arrays.vertices[3 * std::size_t{block.vertex[block.corner[c][t]]} +
                                      static_cast<std::size_t>(k)] -
                      (double{box.low[k][lane]} + double{box.high[k][lane]}) / 2;
        add_integrals(p, sums[at / kWidth], lane);
      }
    }
    span *= kWidth;
  }
}

/// Slabs along the mean normal, or z if there is none.
void find_slabs(MeshArrays& arrays) {
  std::size_t span = 1;  // blocks below a lane
  for (std::size_t level = 0; level < arrays.boxes.size(); ++level, span *= kWidth)
    for (std::size_t at = 0; at * span < arrays.blocks.size(); ++at) {
      BoxBlock& box = arrays.boxes[level][at / kWidth];
      const BoxSums& sums = arrays.sums[level][at / kWidth];
      const std::size_t lane = at % kWidth;
      double length = 0;
      for (const auto& n : sums.normal) length += n[lane] * n[lane];
      length = std::sqrt(length);
      const bool clear = length > 1e-9 * sums.area[lane];
      for (int k = 0; k < 3; ++k)
        box.normal[k][lane] = clear    ? static_cast<float>(sums.normal[k][lane] / length)
                              : k == 2 ? 1.0f
                                       : 0.0f;
      double low = HUGE_VAL, high = -HUGE_VAL;
      for (std::size_t b = at * span; b < std::min((at + 1) * span, arrays.blocks.size()); ++b)
        for (std::uint32_t v = 0; v < arrays.blocks[b].vertices; ++v) {
          const double* x = arrays.vertices.data() + 3 * std::size_t{arrays.blocks[b].vertex[v]};
          const double along = (box.normal[0][lane] * x[0] + box.normal[1][lane] * x[1]) +
                               box.normal[2][lane] * x[2];
          low = std::min(low, along);
          high = std::max(high, along);
        }
      box.slab_low[lane] = rounded_down(low - 1e-14);
      box.slab_high[lane] = rounded_up(high + 1e-14);
    }
}

/// Lays out a closed surface in the form of asset_layout.h: blocks of neighbouring triangles in an
/// order whose groups of 16, 256, … are compact, boxes around them, shells and neighbours. Blocks
/// that share a vertex are neighbours, and their triangles belong to one shell.
///
/// `mesh`: unit frame; vertices are copied bit for bit, except that −0 becomes 0. The caller sets
/// `header.error` and `header.rounding`. Deterministic on any machine.
MeshArrays lay_out_mesh(const MeshView& mesh) {
  MeshArrays arrays;
  lay_out_blocks(mesh, patches_in_order(mesh), arrays);
  find_neighbours(arrays);
  std::vector<Box> boxes(arrays.blocks.size());
  for (std::size_t b = 0; b < boxes.size(); ++b) boxes[b] = box_of(arrays, arrays.blocks[b]);
  find_shells(arrays);
  lay_out_boxes(std::move(boxes), arrays);
  find_sums(arrays);
  find_slabs(arrays);
  return arrays;
}

/// For a mesh that may be unresolved. Unit frame: ∫ |w − [w ≥ 1]| of the winding number w, assuming
/// that its sign is constant. 0: the mesh bounds its solid, except for touching faces.
double estimate_counted_twice(const MeshSolid& solid) {
  constexpr double kNothing = 1e-9;  // of the volume: rounding of touching faces
  if (!solid.may_overlap()) return 0;
  const double more = std::abs(enclosed_moments(solid.arrays()).volume - solid.unit_volume());
  return more > kNothing * solid.unit_volume() ? more : 0;
}

}  // namespace

KeptMesh keep_mesh(const MeshSolid& solid, const Resolution& resolution) {
  KeptMesh kept;
  const double scale = solid.frame().scale();
  if (resolution.how == Resolution::How::resolved) {
    kept.state = MeshState::resolved;
    kept.self_overlap_volume = resolution.counted_twice / (scale * scale * scale);
  } else {
    kept.self_overlap_volume = estimate_counted_twice(solid);
    kept.state = kept.self_overlap_volume > 0 ? MeshState::unresolved : MeshState::own;
  }
  if (kept.state == MeshState::unresolved) return kept;
  MeshArrays mesh = lay_out_mesh(solid.arrays());
  mesh.header.rounding = solid.moved();
  kept.mesh = std::make_shared<const MeshArrays>(std::move(mesh));
  return kept;
}

}  // namespace ist
