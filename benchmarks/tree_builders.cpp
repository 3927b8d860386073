// What swaps, and the order of the inner spheres, cost to build and to query: the same spheres,
// every oracle row of one pair, and copies of other meshes at random poses; counted work. One
// thread.

#include <ist/bake.h>
#include <ist/query.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <ist/asset_layout.h>
#include "bake/asset/asset_writer.h"
#include "bake/cluster/tree_builder.h"
#include "report.h"
#include "support/oracle_rows.h"
#include "support/shared_data.h"
#include "timing.h"

namespace {

using namespace ist;
using benchmark::Report;

struct Builder {
  const char* name;
  bool swaps;
  bool like_inner = false;  ///< the matched spheres' tree from the inner ones' order, as bakes do
};

constexpr Builder kBuilders[] = {
    {"without swaps", false},
    {"with swaps", true},
    {"like the inner spheres'", true, true},
};

/// The asset with its trees built again.
Asset rebuilt(const Asset& asset, const Builder& builder) {
  const AssetHeader& header = asset.view().header();
  const std::size_t n = header.sphere_count;
  const auto copy = [&]<class T>(const T* from) { return std::vector<T>(from, from + n); };
  AssetArrays arrays;
  arrays.header = header;
  arrays.inner_spheres = copy(at<Sphere>(header, header.inner_spheres));
  arrays.cover_radii = copy(at<float>(header, header.cover_radii));
  arrays.matched_spheres = copy(at<Sphere>(header, header.matched_spheres));
  const std::vector<std::uint32_t> order = sphere_order(arrays.inner_spheres, builder.swaps);
  arrays.inner_tree = tree_from_order(arrays.inner_spheres, arrays.cover_radii, order);
  arrays.matched_tree = builder.like_inner ? build_tree_like(arrays.matched_spheres, order)
                                           : build_tree(arrays.matched_spheres, {}, builder.swaps);
  return Asset(asset_bytes(arrays), builder.name);
}

/// A copy's pose: any rotation, 5 to 50 % of the size away.
Pose random_pose(std::mt19937& bits, double size) {
  const auto normal = [&] {  // near enough, and the same everywhere
    double sum = -6;
    for (int i = 0; i < 12; ++i) sum += static_cast<double>(bits()) / 4294967296.0;
    return sum;
  };
  const auto direction = [&](double* x, int count, double length) {
    double square = 0;
    for (int k = 0; k < count; ++k) {
      x[k] = normal();
      square += x[k] * x[k];
    }
    for (int k = 0; k < count; ++k) x[k] *= length / std::sqrt(square);
  };
  Pose pose;
  direction(pose.q, 4, 1);
  direction(pose.t, 3, size * (0.05 + 0.45 * static_cast<double>(bits()) / 4294967296.0));
  return pose;
}

double mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

}  // namespace

int main(int argc, char** argv) {
  Report report("tree_builders", argc, argv);
  const auto rows = testing::read_oracle_rows("eledino");
  const std::vector<std::size_t> counts =
      report.quick() ? std::vector<std::size_t>{1000} : std::vector<std::size_t>{4000, 16000};
  for (const std::size_t n : counts) {
    PackingSettings settings;
    settings.max_spheres = n;
    const auto baked = [&](const char* name) {
      const std::string path = testing::oracle_mesh_path(name);
      return bake(close_mesh(load_mesh(path), path), settings);
    };
    const Asset elephant = baked("elephant");
    const Asset dino = baked("dino");
    for (const Builder& builder : kBuilders) {
      const double start = benchmark::process_seconds();
      const Asset a = rebuilt(elephant, builder);
      const double seconds = benchmark::process_seconds() - start;
      const Asset b = rebuilt(dino, builder);
      Workspace workspace;
      for (const std::string pose_class : {"sep", "pen", "deep", "contain"}) {
        std::vector<double> visits;
        std::vector<double> pairs;
        std::vector<double> gap_visits;
        std::vector<double> gap_pairs;
        for (const auto& row : rows) {
          if (row.pose_class != pose_class) continue;
          const bool first = row.mesh_a.starts_with("elephant");
          const PlacedAsset placed_a = {(first ? a : b).view(), {}, 1};
          const PlacedAsset placed_b = {(first ? b : a).view(), row.pose, row.scale_b};
          const Penetration p = penetration(placed_a, placed_b, {}, workspace);
          const Separation s = separation(placed_a, placed_b, {}, workspace);
          visits.push_back(p.node_visits);
          pairs.push_back(p.sphere_pairs);
          gap_visits.push_back(s.node_visits);
          gap_pairs.push_back(s.sphere_pairs);
        }
        report.row("Work of a query, elephant-dino, mean",
                   {{"spheres", n},
                    {"builder", builder.name},
                    {"build of two trees, CPU [s]", seconds},
                    {"class", pose_class},
                    {"node visits", mean(visits)},
                    {"sphere pairs", mean(pairs)},
                    {"separation: node visits", mean(gap_visits)},
                    {"separation: sphere pairs", mean(gap_pairs)}});
      }
    }
  }
  const std::vector<const char*> files =
      report.quick()
          ? std::vector<const char*>{"spot.obj"}
          : std::vector<const char*>{"bunny_60k.ply", "spot.obj", "bolt_gen.ply", "mug.ply"};
  for (const char* const file : files) {
    const std::string path = testing::shared_path(std::string("meshes/dev/") + file).string();
    const ClosedMesh mesh = close_mesh(load_mesh(path), path);
    Eigen::AlignedBox3d box;
    for (const Eigen::Vector3d& x : mesh.mesh.vertices) box.extend(x);
    for (const std::size_t n : counts) {
      PackingSettings settings;
      settings.max_spheres = n;
      settings.keep_mesh = false;
      const Asset asset = bake(mesh, settings);
      double own = 0;
      for (const Builder& builder : kBuilders) {
        if (!builder.swaps) continue;
        const Asset tree = rebuilt(asset, builder);
        std::mt19937 bits(7);
        Workspace workspace;
        std::vector<double> visits;
        for (int i = 0; i < 300; ++i) {
          const Pose pose = random_pose(bits, box.sizes().norm());
          visits.push_back(
              penetration({tree.view(), {}, 1}, {tree.view(), pose, 1}, {}, workspace).node_visits);
        }
        if (!builder.like_inner) own = mean(visits);
        report.row("Work of a query of two copies, mean of 300 poses",
                   {{"mesh", file},
                    {"spheres", n},
                    {"builder", builder.name},
                    {"node visits", mean(visits)},
                    {"of its own order's", mean(visits) / own}});
      }
    }
  }
  return report.write();
}
