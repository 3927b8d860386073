// What a batch of poses costs through Python, beside penetration_batch() in C++: the same rows in
// the same process, a round of one after a round of the other.

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <algorithm>
#include <iterator>
#include <string>
#include <vector>

#include <ist/query.h>
#include <ist/query_tbb.h>

#include "report.h"
#include "support/oracle_assets.h"
#include "timing.h"

namespace {

namespace py = nanobind;
using ist::benchmark::quantile;
using ist::benchmark::Report;

/// Poses of one class, in both languages.
struct Batch {
  std::vector<ist::PlacedPair> pairs;
  py::object a, b;
  std::vector<double> pose_rows, scale_rows;

  py::object poses() const { return array(pose_rows, {scale_rows.size(), 7}); }
  py::object scales() const { return array(scale_rows, {scale_rows.size()}); }

 private:
  static py::object array(const std::vector<double>& values,
                          std::initializer_list<std::size_t> shape) {
    return py::cast(py::ndarray<py::numpy, const double>(values.data(), shape, py::none()));
  }
};

py::object in_python(const py::module_& module, const ist::Asset& asset) {
  const auto bytes = asset.bytes();
  return module.attr("Asset").attr("from_bytes")(
      py::bytes(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
}

/// Rows of a class over and over: elephant on dino, always the same way round.
Batch make_batch(const py::module_& module, const std::string& pose_class, std::size_t count,
                 std::size_t spheres) {
  std::vector<ist::PlacedPair> rows;
  Batch batch;
  std::string mesh_a, mesh_b;
  for (const ist::testing::OracleRow& row : ist::testing::read_oracle_rows("eledino")) {
    if (row.pose_class != pose_class) continue;
    if (rows.empty()) mesh_a = row.mesh_a, mesh_b = row.mesh_b;
    if (row.mesh_a != mesh_a || row.mesh_b != mesh_b) continue;
    const auto [a, b] = ist::testing::placed(row, spheres);
    rows.push_back({a, b});
  }
  batch.a = in_python(module, ist::testing::oracle_asset(mesh_a, spheres));
  batch.b = in_python(module, ist::testing::oracle_asset(mesh_b, spheres));
  for (std::size_t i = 0; i < count; ++i) {
    const auto& b = std::get<ist::PlacedAsset>(rows[i % rows.size()].b.placed);
    batch.pairs.push_back(rows[i % rows.size()]);
    std::copy(std::begin(b.pose.q), std::end(b.pose.q), std::back_inserter(batch.pose_rows));
    std::copy(std::begin(b.pose.t), std::end(b.pose.t), std::back_inserter(batch.pose_rows));
    batch.scale_rows.push_back(b.scale);
  }
  return batch;
}

}  // namespace

// nanobind wants a module of this program before it works in it.
NB_MODULE(python_batch, /*module*/) {}

int main(int argc, char** argv) {
  Report report("python_batch", argc, argv);
  report.page("Batches through Python");
  report.remark(
      "Elephant and dino, 4,000 spheres each, rows of the oracle over and over: arrays into "
      "ist.penetration and arrays out of it, beside penetration_batch() over pairs that are made "
      "already. Medians of rounds in turn, time of all threads together, so that other programs do "
      "not count; the ratio is the median of the rounds' ratios.");
  const std::size_t count = report.quick() ? 1000 : 10'000;
  const std::size_t spheres = report.quick() ? 1000 : 4000;
  const int rounds = report.quick() ? 5 : 9;
  PyImport_AppendInittab("python_batch", PyInit_python_batch);
  Py_Initialize();
  py::module_::import_("python_batch");
  py::module_::import_("sys").attr("path").attr("insert")(0, IST_PYTHON_PACKAGE);
  const py::module_ module = py::module_::import_("ist");
  double worst = 0;
  for (const std::string name : {"sep", "pen", "deep", "contain"}) {
    const Batch batch = make_batch(module, name, count, spheres);
    const py::object poses = batch.poses(), scales = batch.scales();
    for (const unsigned threads : {1u, 0u}) {
      std::vector<ist::Workspace> workspaces;
      const std::size_t workers = threads == 1 ? 1 : std::thread::hardware_concurrency();
      for (std::size_t i = 0; i < workers; ++i) workspaces.emplace_back();
      std::vector<ist::Penetration> answers(count);
      const auto in_cpp = [&] {
        penetration_batch(batch.pairs, {}, workspaces, answers,
                          threads == 1 ? ist::ParallelFor{} : ist::tbb_parallel_for());
      };
      py::object found;
      const py::object penetration = module.attr("penetration");
      const auto in_python = [&] {
        found = penetration(batch.a, batch.b, poses, py::arg("scales") = scales,
                            py::arg("threads") = threads);
      };
      const auto time = [&](const auto& work) {
        const double start = ist::benchmark::process_seconds();
        work();
        return 1e6 * (ist::benchmark::process_seconds() - start) / static_cast<double>(count);
      };
      time(in_cpp), time(in_python);
      std::vector<double> cpp, python, ratios;
      for (int round = 0; round < rounds; ++round) {
        double one, other;
        if (round % 2 == 0) {
          one = time(in_cpp), other = time(in_python);
        } else {
          other = time(in_python), one = time(in_cpp);
        }
        cpp.push_back(one), python.push_back(other), ratios.push_back(other / one);
      }
      const auto volumes = py::cast<py::ndarray<const double, py::ndim<1>>>(found.attr("volume"));
      for (std::size_t i = 0; i < count; ++i)
        if (volumes(i) != answers[i].volume)
          return std::fprintf(stderr, "python_batch: C++ and Python differ\n"), 1;
      report.row("µs a query of a batch of " + std::to_string(count),
                 {{"class", name},
                  {"threads", workers},
                  {"C++", quantile(cpp, 0.5)},
                  {"Python", quantile(python, 0.5)},
                  {"Python / C++", quantile(ratios, 0.5)}});
      if (threads == 1) worst = std::max(worst, quantile(ratios, 0.5));
    }
    // A call by itself: what is not the query's.
    const ist::PlacedPair& pair = batch.pairs[0];
    ist::Workspace workspace;
    const py::object pose = poses[0], scale = scales[0];
    const py::object penetration = module.attr("penetration");
    std::vector<double> cpp, python;
    for (int i = 0; i < 300; ++i) {
      double start = ist::benchmark::wall_seconds();
      ist::penetration(pair.a, pair.b, {}, workspace);
      cpp.push_back(1e6 * (ist::benchmark::wall_seconds() - start));
      start = ist::benchmark::wall_seconds();
      penetration(batch.a, batch.b, pose, py::arg("scales") = scale);
      python.push_back(1e6 * (ist::benchmark::wall_seconds() - start));
    }
    report.row("µs a call of one pose",
               {{"class", name}, {"C++", quantile(cpp, 0.5)}, {"Python", quantile(python, 0.5)}});
  }
  report.target("worst ratio of Python to C++, one thread", worst, 1.1, true);
  return report.write();
}
