// What each way of clustering costs to build and to query: the same spheres, every oracle row of
// one pair, counted work. One thread.

#include <ist/bake.h>
#include <ist/query.h>

#include <string>
#include <vector>

#include <ist/asset_layout.h>
#include "asset/asset_writer.h"
#include "bake/cluster/tree_builder.h"
#include "report.h"
#include "support/oracle_rows.h"
#include "timing.h"

namespace {

using namespace ist;
using benchmark::Report;

struct Builder {
  const char* name;
  Clustering clustering;
  bool swaps;
};

constexpr Builder kBuilders[] = {
    {"2-means", Clustering::two_means, false},
    {"2-means, swaps", Clustering::two_means, true},
    {"neural gas", Clustering::neural_gas, false},
    {"neural gas, swaps", Clustering::neural_gas, true},
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
  arrays.inner_tree =
      build_tree(arrays.inner_spheres, arrays.cover_radii, builder.clustering, builder.swaps);
  arrays.matched_tree = build_tree(arrays.matched_spheres, {}, builder.clustering, builder.swaps);
  return Asset(asset_bytes(arrays), builder.name);
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
          const PlacedTree placed_a = {(first ? a : b).view(), {}, 1};
          const PlacedTree placed_b = {(first ? b : a).view(), row.pose, row.scale_b};
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
  return report.write();
}
