#include "bake/surface/build_surface.h"

#include <ist/error.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "bake/cluster/ball_blocks.h"
#include "bake/surface/float_mesh.h"
#include "bake/surface/sign_grid.h"
#include "bake/surface/solid_surface.h"
#include "bake/surface/surface_area.h"
#include "bake/surface/surface_error.h"
#include "bake/surface/surface_hierarchy.h"
#include "bake/surface/surface_patches.h"
#include "bake/surface/vertex_clusters.h"

namespace ist {
namespace {

/// A patch as a block.
SurfaceBlock block_of(const FloatMesh& mesh, const BlockPatch& patch) {
  SurfaceBlock block = {};
  block.triangles = static_cast<std::uint32_t>(patch.triangles.size());
  block.vertices = static_cast<std::uint32_t>(patch.vertices.size());
  for (std::size_t v = 0; v < kWidth; ++v) {
    const FloatMesh::Vertex& x = mesh.vertices[patch.vertices[v < patch.vertices.size() ? v : 0]];
    block.x[v] = x[0];
    block.y[v] = x[1];
    block.z[v] = x[2];
  }
  for (std::size_t i = 0; i < patch.triangles.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k)
      block.corner[k][i] = patch.place_of(mesh.triangles[patch.triangles[i]][k]);
  return block;
}

std::vector<SurfaceBlock> blocks_of(const FloatMesh& mesh) {
  const std::vector<BlockPatch> patches = cut_into_patches(mesh);
  std::vector<SurfaceBlock> blocks(patches.size());
  tbb::parallel_for(std::size_t{0}, blocks.size(),
                    [&](std::size_t b) { blocks[b] = block_of(mesh, patches[b]); });
  return blocks;
}

Ball vertex_of(const SurfaceBlock& block, std::uint32_t v) {
  return {block.x[v], block.y[v], block.z[v], 0};
}

std::vector<SurfaceBlock> in_order(const std::vector<SurfaceBlock>& blocks) {
  std::vector<std::array<float, 3>> middles(blocks.size());
  tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t b) {
    std::array<Ball, kWidth> vertices;
    for (std::uint32_t v = 0; v < blocks[b].vertices; ++v) vertices[v] = vertex_of(blocks[b], v);
    const Ball ball = bounding_ball(std::span(vertices).first(blocks[b].vertices));
    middles[b] = {static_cast<float>(ball.x), static_cast<float>(ball.y),
                  static_cast<float>(ball.z)};
  });
  const std::vector<std::uint32_t> order = spatial_order(middles);
  std::vector<SurfaceBlock> sorted(blocks.size());
  for (std::size_t b = 0; b < blocks.size(); ++b) sorted[b] = blocks[order[b]];
  return sorted;
}

/// A ball around the triangles of consecutive blocks.
Sphere ball_around(std::span<const SurfaceBlock> blocks) {
  std::vector<Ball> vertices;
  for (const SurfaceBlock& block : blocks)
    for (std::uint32_t v = 0; v < block.vertices; ++v) vertices.push_back(vertex_of(block, v));
  return ball_around(vertices);
}

/// Cuts the surface into blocks of neighbouring triangles and puts balls around the blocks, level
/// by level: `blocks` and `levels` of the arrays. Every ball holds the triangles below it for
/// certain. The mesh must have a triangle.
void cut_into_blocks(const FloatMesh& mesh, SurfaceArrays& arrays) {
  arrays.blocks = in_order(blocks_of(mesh));
  const std::span<const SurfaceBlock> all = arrays.blocks;
  for (std::size_t span = 1; span < all.size(); span *= kWidth) {
    std::vector<Sphere> balls((all.size() + span - 1) / span);
    tbb::parallel_for(std::size_t{0}, balls.size(), [&](std::size_t i) {
      balls[i] = ball_around(all.subspan(i * span, std::min(span, all.size() - i * span)));
    });
    TreeLevelArrays& level = arrays.levels.emplace_back();
    fill_blocks(balls, level.blocks, level.origins);
  }
}

/// Where a mesh meets itself and reaches no further than this, the mesh is the surface: unit frame,
/// 0.5 % of a solid's size.
constexpr double kOverlapWidth = 0.01;

/// Up to so many triangles a surface may take as many bytes, what the spheres take in an asset of
/// 10,000.
constexpr std::size_t kFewTriangles = 25'000;
constexpr std::size_t kFewBytes = 1'000'000;

/// A surface and how far it is from the solid's, unit frame.
struct Approximation {
  FloatMesh mesh;
  double error = 0;
};

/// What the grid of a surface may take.
std::size_t grid_bytes(const SurfaceArrays& arrays) {
  // A small surface's grid is fine, a large one's coarse; beyond kFewTriangles it is as coarse as
  // there.
  const std::size_t triangles = arrays.header.triangle_count;
  const std::size_t whole =
      std::min(16'384 + 50 * triangles, std::max(kFewBytes, kFewBytes / kFewTriangles * triangles));
  std::size_t surface = sizeof(SurfaceHeader) + 16 * kAssetAlignment;
  surface += arrays.blocks.size() * sizeof(SurfaceBlock);
  for (const TreeLevelArrays& level : arrays.levels)
    surface += level.blocks.size() * (sizeof(BallBlock) + sizeof(Origin));
  const std::size_t least = 12 * triangles;
  return whole > surface + least ? whole - surface : least;
}

/// The blocks and the grid of a surface. `hierarchy()`: it as a view with a hierarchy.
template <class Hierarchy>
SurfaceArrays laid_out(const FloatMesh& mesh, const Hierarchy& hierarchy) {
  SurfaceArrays arrays;
  arrays.header.triangle_count = static_cast<std::uint32_t>(mesh.triangles.size());
  MeshView view;
  tbb::parallel_invoke([&] { cut_into_blocks(mesh, arrays); }, [&] { view = hierarchy(); });
  lay_sign_grid(view, grid_bytes(arrays), arrays);
  return arrays;
}

/// Triangles that are not in a reduced mesh, not even as a side or a corner: fins and needles
/// thinner than float precision, whose faces cancel. `before`: its triangles; `place`: reduce()'s.
FloatMesh lost(const FloatMesh& mesh, const std::vector<FloatMesh::Triangle>& before,
               const std::vector<std::uint32_t>& place) {
  using Corners = FloatMesh::Triangle;
  const auto named = [](Corners t) {  // a side as a, b, b
    std::sort(t.begin(), t.end());
    if (t[0] == t[1]) t[1] = t[2];
    return t;
  };
  std::vector<Corners> there;
  for (const Corners& t : mesh.triangles) {
    there.push_back(named(t));
    for (std::size_t k = 0; k < 3; ++k) {
      there.push_back(named({t[k], t[k], t[(k + 1) % 3]}));
      there.push_back({t[k], t[k], t[k]});
    }
  }
  std::sort(there.begin(), there.end());
  FloatMesh out{mesh.vertices, {}};
  for (const Corners& t : before) {
    const Corners now = {place[t[0]], place[t[1]], place[t[2]]};
    if (!std::binary_search(there.begin(), there.end(), named(now))) out.triangles.push_back(now);
  }
  return out;
}

/// The triangles themselves over vertices rounded to float: no point moves further than a vertex,
/// but that some triangles vanish.
Approximation own_triangles(const MeshView& surface) {
  Approximation out{in_floats(surface)};
  for (std::size_t v = 0; v < out.mesh.vertices.size(); ++v) {
    double moved2 = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double moved = surface.vertices[3 * v + k] - double{out.mesh.vertices[v][k]};
      moved2 += moved * moved;
    }
    out.error = std::max(out.error, std::sqrt(moved2) * (1 + 1e-12));
  }
  const std::vector<FloatMesh::Triangle> before = out.mesh.triangles;
  const std::vector<std::uint32_t> place = reduce(out.mesh);
  if (out.mesh.triangles.empty() || out.mesh.triangles.size() == before.size()) return out;
  const FloatMesh gone = lost(out.mesh, before, place);
  if (!gone.triangles.empty()) out.error += farthest_from(SurfaceHierarchy(out.mesh), gone);
  return out;
}

/// Clusters within a tolerance, or nearly: those that turn out to be further off are divided, a few
/// times over, and so are those for which nothing better can be proven.
Approximation clustered(VertexClusters& clusters, SolidSurface& surface, KnownDistances& distances,
                        double tolerance, const WorkStop& stop) {
  constexpr int kRounds = 5, kProofs = 2;
  constexpr double kLoose = 3;  // of what is seen: proven more, it is worth another proof
  Approximation best{{}, HUGE_VAL};
  int proofs = 0;
  for (int round = 1;; ++round) {
    stop.look();
    Clustered found = clusters.within(tolerance);
    if (found.mesh.triangles.empty()) return best;
    const SurfaceHierarchy hierarchy(found.mesh);
    SurfaceError error(surface.view(), distances, found, hierarchy, stop);
    std::vector<double> off = error.seen(tolerance);
    const double seen = *std::max_element(off.begin(), off.end());
    if (seen <= 1.25 * tolerance || round >= kRounds) {
      SurfaceError::Proven proven = error.proven(seen, kLoose * seen);
      if (proven.most < best.error) best = {std::move(found.mesh), proven.most};
      if (proven.most <= kLoose * seen || ++proofs == kProofs) return best;
      off = std::move(proven.at_cluster);
      for (double& at : off) at = at > kLoose * seen ? at : 0;
    }
    clusters.raise(off);
  }
}

/// The coarsest clusters found that keep within the error; nothing where none were.
std::optional<Approximation> clustered_within(VertexClusters& clusters, SolidSurface& surface,
                                              double max_error, const WorkStop& stop) {
  std::optional<Approximation> best;
  KnownDistances distances(surface.view());
  double fine = 0, coarse = HUGE_VAL, tolerance = max_error / 2;
  for (int attempt = 0; attempt < 8 && coarse > 1.05 * fine; ++attempt) {
    Approximation tried = clustered(clusters, surface, distances, tolerance, stop);
    const double ratio = max_error / tried.error;
    if (tried.error <= max_error) {
      fine = tolerance;
      best = std::move(tried);
    } else {
      coarse = tolerance;
    }
    tolerance *= std::clamp(0.97 * ratio, 0.125, 4.0);
    if (fine > 0 && coarse < HUGE_VAL && !(tolerance > fine && tolerance < coarse))
      tolerance = std::sqrt(fine * coarse);
  }
  return best;
}

/// Fewer triangles than the surface has; nothing where they cannot be as exact as is asked for.
std::optional<Approximation> simplified(SolidSurface& surface, double max_error,
                                        const WorkStop& stop) {
  const MeshView& arrays = surface.arrays();
  // Cells of edge c span about 3 area / c² triangles.
  const double cell = std::sqrt(3 * surface_area(arrays) / kFewTriangles);
  VertexClusters clusters(arrays, 8 * cell, 10);
  std::optional<Approximation> few = clustered_within(clusters, surface, max_error, stop);
  if (!few || few->mesh.triangles.empty() || few->mesh.triangles.size() >= arrays.triangle_count)
    return std::nullopt;
  return few;
}

}  // namespace

std::optional<BuiltSurface> build_surface(const MeshSolid& solid, double max_error,
                                          const WorkStop& stop) {
  std::optional<SolidSurface> surface = SolidSurface::of(
      solid, max_error > 0 ? std::min(kOverlapWidth, max_error / 2) : kOverlapWidth);
  if (!surface) return std::nullopt;
  // The surface's own distance from the solid comes on top.
  const double left = max_error - surface->off();
  std::optional<Approximation> few;
  if (max_error > 0) few = simplified(*surface, left, stop);
  const bool own = !few;
  Approximation near = own ? own_triangles(surface->arrays()) : *std::move(few);
  if (own && max_error > 0 && !(near.error <= left))
    throw Error("the requested surface error is below float precision; request at least " +
                std::to_string(near.error / left) + " times as much");
  if (near.mesh.triangles.empty()) return std::nullopt;
  std::optional<SurfaceHierarchy> hierarchy;
  BuiltSurface built = {
      laid_out(near.mesh, [&] { return hierarchy.emplace(near.mesh).view(); }), {}, own};
  built.arrays.header.error = near.error + surface->off();
  built.mesh = std::move(near.mesh);
  return built;
}

}  // namespace ist
