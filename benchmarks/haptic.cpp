// How late a 1 kHz loop gets its answers: examples/haptic_loop with the dragon and a bolt, on an
// idle machine and beside threads that want its processors too, without and with real-time
// priority.

#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include <ist/bake.h>

#include "report.h"
#include "samples/samples.h"
#include "support/shared_data.h"

namespace {

using ist::benchmark::Report;

ist::Asset bake_file(ist::TriangleMesh mesh, const std::string& name, std::size_t spheres,
                     const std::filesystem::path& file) {
  ist::Asset asset = ist::bake(ist::close_mesh(std::move(mesh), name), {.max_spheres = spheres});
  asset.save(file);
  return asset;
}

struct Setup {
  int load = 0;  ///< threads
  bool priority = false;
};

}  // namespace

int main(int argc, char** argv) {
  Report report("haptic", argc, argv);
  report.remark(
      "examples/haptic_loop: a probe is dragged over an object; penetration and separation are "
      "asked at every tick of 1 ms.");
  report.remark(
      "Load: threads that compute and walk through 64 MB each. Missed: the answer came after the "
      "next tick was due. By the query: it computed for longer than a period; by the timer: the "
      "loop was woken too late; interrupted: something else ran in the midst of a query.");
  const std::size_t spheres = report.quick() ? 1'000 : 10'000;
  const std::string seconds = report.quick() ? "2" : "60";
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("ist_haptic_" + std::to_string(getpid()));
  std::filesystem::create_directory(folder);
  const std::string object_name = report.quick() ? "bunny_60k" : "dragon_871k";
  const std::filesystem::path mesh =
      ist::testing::shared_path("meshes/dev/" + object_name + ".ply");
  const ist::Asset object =
      bake_file(ist::load_mesh(mesh), object_name, spheres, folder / "object.ist");
  const ist::Asset probe =
      bake_file(ist::make_sample("bolt"), "bolt", spheres, folder / "probe.ist");
  // The probe's volume is a fiftieth of the object's.
  const double scale = std::cbrt(object.view().volume() / probe.view().volume() / 50);

  int failures = 0;
  for (const Setup setup : {Setup{0, false}, {1, false}, {4, false}, {4, true}}) {
    const std::filesystem::path json = folder / "haptic.json";
    const std::string command = "'" IST_PROGRAM "' '" + (folder / "object.ist").string() + "' '" +
                                (folder / "probe.ist").string() + "' --scale " +
                                std::to_string(scale) + " --seconds " + seconds + " --load " +
                                std::to_string(setup.load) + (setup.priority ? " --fifo" : "") +
                                " --json '" + json.string() + "' 1>&2";
    if (std::system(command.c_str()) != 0) {
      ++failures;
      continue;
    }
    const auto run = nlohmann::json::parse(std::ifstream(json));
    const int load = setup.load;
    const bool priority = run.at("fifo");
    const auto microseconds = [&](const char* what, const char* key) {
      const auto& us = run.at(key);
      report.row("Times a tick, µs", {{"load", load},
                                      {"real-time priority", priority},
                                      {"what", what},
                                      {"p50", us.at("p50")},
                                      {"p99", us.at("p99")},
                                      {"p99.9", us.at("p99.9")},
                                      {"max", us.at("max")}});
    };
    microseconds("timer: from the tick to being woken", "overslept_us");
    microseconds("query, time of its thread", "computed_us");
    microseconds("query, wall time", "query_us");
    microseconds("from the tick to the answer", "late_us");
    report.row("Missed deadlines", {{"load", load},
                                    {"real-time priority", priority},
                                    {"object", object_name},
                                    {"spheres", run.at("object_spheres")},
                                    {"probe's spheres", run.at("probe_spheres")},
                                    {"ticks", run.at("ticks")},
                                    {"in contact", run.at("in_contact")},
                                    {"missed", run.at("missed")},
                                    {"by the query", run.at("missed_by_query")},
                                    {"by the timer", run.at("missed_by_timer")},
                                    {"interrupted", run.at("interrupted")},
                                    {"ticks skipped", run.at("skipped")}});
    report.target("deadlines missed by the query, load " + std::to_string(load) +
                      (priority ? ", real-time priority" : ""),
                  run.at("missed_by_query").get<double>(), 0, true);
  }
  std::filesystem::remove_all(folder);
  const int written = report.write();
  return failures > 0 ? 1 : written;
}
