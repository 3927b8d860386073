// What a query costs through the C functions, beside the same query in C++: the same rows in the
// same process, a round of one after a round of the other.

#include <algorithm>
#include <bit>
#include <string>
#include <vector>

#include <ist/c.h>
#include <ist/query.h>
#include <ist/shapes.h>

#include "report.h"
#include "support/oracle_assets.h"
#include "timing.h"

namespace {

using ist::benchmark::quantile;
using ist::benchmark::Report;

/// A row in both languages.
struct Row {
  ist::PlacedAsset a, b;
  ist_asset_t tree_a, tree_b;
  ist_placed_t c_a, c_b;  ///< point to these
};

/// Medians over rounds.
struct Times {
  double cpp = 0, c = 0;  ///< [µs] a query
  double ratio = 0;       ///< of C to C++, the median of the rounds' ratios
};

/// `cpp(i)` and `c(i)` answer row i; the order within a pair of rounds alternates.
template <class Cpp, class C>
Times measure(std::size_t rows, int rounds, const Cpp& cpp, const C& c) {
  std::vector<double> in_cpp, in_c, ratios;
  const auto time = [&](const auto& answer) {
    const double start = ist::benchmark::thread_seconds();
    for (std::size_t i = 0; i < rows; ++i) answer(i);
    return 1e6 * (ist::benchmark::thread_seconds() - start) / static_cast<double>(rows);
  };
  time(cpp), time(c);
  for (int round = 0; round < rounds; ++round) {
    double one, other;
    if (round % 2 == 0) {
      one = time(cpp), other = time(c);
    } else {
      other = time(c), one = time(cpp);
    }
    in_cpp.push_back(one), in_c.push_back(other), ratios.push_back(other / one);
  }
  return {quantile(in_cpp, 0.5), quantile(in_c, 0.5), quantile(ratios, 0.5)};
}

std::uint64_t bits(double value) { return std::bit_cast<std::uint64_t>(value); }

/// A struct of the C functions, set up.
template <class T>
T sized() {
  T result = {};
  result.size = sizeof result;
  return result;
}

ist_placed_t in_c(const ist_asset_t& tree, const ist::PlacedAsset& like) {
  return {sizeof(ist_placed_t), &tree, nullptr, std::bit_cast<ist_pose_t>(like.pose), like.scale};
}

}  // namespace

int main(int argc, char** argv) {
  Report report("c_api", argc, argv);
  report.page("The C functions");
  const std::size_t spheres = report.quick() ? 1000 : 4000;
  const int rounds = report.quick() ? 21 : 201;
  ist::Workspace workspace;
  ist_workspace_t c_workspace = {};
  if (ist_workspace_make(0, nullptr, &c_workspace) != IST_OK) return 1;

  // As C programs keep them: the size is set once.
  auto c_penetration = sized<ist_penetration_t>();
  auto c_separation = sized<ist_separation_t>();

  double worst = 0;
  for (const std::string name : {"sep", "pen", "deep", "contain"}) {
    std::vector<Row> rows;
    for (const ist::testing::OracleRow& row : ist::testing::read_oracle_rows("eledino")) {
      if (row.pose_class != name) continue;
      const auto [a, b] = ist::testing::placed(row, spheres);
      Row& both = rows.emplace_back(Row{a, b, {}, {}, {}, {}});
      const auto view = [&](const std::string& mesh, ist_asset_t& tree) {
        const auto bytes = ist::testing::oracle_asset(mesh, spheres).bytes();
        return ist_asset_view(bytes.data(), bytes.size(), &tree) == IST_OK;
      };
      if (!view(row.mesh_a, both.tree_a) || !view(row.mesh_b, both.tree_b)) return 1;
    }
    for (Row& row : rows) {  // where they stay
      row.c_a = in_c(row.tree_a, row.a);
      row.c_b = in_c(row.tree_b, row.b);
    }
    const auto note = [&](const std::string& query, const Times& times) {
      report.row("µs a query, thread time, medians of rounds over all rows of a class",
                 {{"query", query},
                  {"class", name},
                  {"rows", rows.size()},
                  {"C++", times.cpp},
                  {"C", times.c},
                  {"C / C++", times.ratio}});
      worst = std::max(worst, times.ratio);
    };
    std::uint64_t sum = 0;  // of the answers' bits: C takes away what C++ adds
    note("penetration", measure(
                            rows.size(), rounds,
                            [&](std::size_t i) {
                              sum += bits(penetration(rows[i].a, rows[i].b, {}, workspace).volume);
                            },
                            [&](std::size_t i) {
                              ist_penetration(&rows[i].c_a, &rows[i].c_b, nullptr, &c_workspace,
                                              &c_penetration);
                              sum -= bits(c_penetration.volume);
                            }));
    note("separation", measure(
                           rows.size(), rounds,
                           [&](std::size_t i) {
                             sum += bits(separation(rows[i].a, rows[i].b, {}, workspace).distance);
                           },
                           [&](std::size_t i) {
                             ist_separation(&rows[i].c_a, &rows[i].c_b, nullptr, &c_workspace,
                                            &c_separation);
                             sum -= bits(c_separation.distance);
                           }));
    note("overlap",
         measure(
             rows.size(), rounds,
             [&](std::size_t i) {
               sum += static_cast<std::uint64_t>(overlap(rows[i].a, rows[i].b, workspace).answer);
             },
             [&](std::size_t i) {
               ist_yes_no_t answer;
               ist_overlap(&rows[i].c_a, &rows[i].c_b, &c_workspace, &answer);
               sum -= static_cast<std::uint64_t>(answer);
             }));
    // A field: what is asked is made anew each time, as of the trees.
    note("half-space",
         measure(
             rows.size(), rounds,
             [&](std::size_t i) {
               const ist::PlacedShape plane{ist::HalfSpaceShape{}, rows[i].a.pose, 1};
               sum += bits(penetration(plane, rows[i].b, {}, workspace).volume);
             },
             [&](std::size_t i) {
               auto field = sized<ist_shape_t>();
               field.kind = IST_HALF_SPACE;
               field.as.half_space.normal[2] = 1;
               const ist_placed_t plane = {sizeof plane, nullptr, &field,
                                           std::bit_cast<ist_pose_t>(rows[i].a.pose), 1};
               ist_penetration(&plane, &rows[i].c_b, nullptr, &c_workspace, &c_penetration);
               sum -= bits(c_penetration.volume);
             }));
    if (sum != 0) return std::fprintf(stderr, "c_api: C and C++ differ\n"), 1;
  }
  ist_workspace_release(&c_workspace);
  report.target("worst ratio of C to C++", worst, 1.02, true);
  return report.write();
}
