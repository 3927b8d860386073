// How late a haptic loop gets its force: examples/haptic_loop with a probe on a dragon, a peg in a
// hole and a nut on a bolt, at 1, 5 and 10 kHz, on an idle machine and while all other cores are
// loaded.

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

#include <ist/bake.h>

#include "mesh/samples/samples.h"
#include "report.h"
#include "support/baked.h"
#include "support/shared_data.h"

namespace {

using ist::benchmark::Report;

struct Scene {
  const char *name, *object, *probe, *motion;
};

/// docs/haptics.md measures the passivity of the same.
constexpr Scene kScenes[] = {
    {"nut dragged over a dragon", "dragon_174k.ply", "nut", "--scale 0.0021"},
    {"peg in a hole", "hole_tray_round_16mm.obj", "peg_round_16mm.obj",
     "--motion insert --from 0,0,0.03 --to 0,0,0.001 --wiggle 0.0004"},
    {"nut on a bolt", "bolt", "nut",
     "--motion insert --from 0,0,10 --to 0,0,6 --turns -2 --wiggle 0.1"},
};
constexpr std::size_t kSpheres = 4000;

/// The baked part, in a folder; made there if it is missing.
std::filesystem::path part(const std::filesystem::path& folder, const char* name) {
  const std::filesystem::path file = folder / (std::string(name) + ".ist");
  if (!std::filesystem::exists(file)) {
    const bool is_file = std::filesystem::path(name).has_extension();
    ist::testing::baked(
        is_file ? ist::load_mesh(ist::testing::shared_path(std::string("meshes/dev/") + name))
                : ist::make_sample(name),
        name, kSpheres)
        .save(file);
  }
  return file;
}

/// What the loop reports; null if it failed.
nlohmann::json run(const Scene& scene, const std::filesystem::path& folder, int hz, int load,
                   bool priority, double seconds) {
  // Beside this program, wherever both were carried.
  const std::filesystem::path loop =
      std::filesystem::read_symlink("/proc/self/exe").parent_path().parent_path() / "haptic_loop";
  const std::filesystem::path json =
      std::filesystem::temp_directory_path() / ("haptic_" + std::to_string(getpid()) + ".json");
  std::ostringstream command;
  command << loop << ' ' << part(folder, scene.object) << ' ' << part(folder, scene.probe) << ' '
          << scene.motion << " --rate " << hz << " --seconds " << seconds << " --cycles "
          << seconds / 4 << " --load " << load << (priority ? " --fifo" : "") << " --json " << json
          << " 1>&2";
  nlohmann::json result;
  if (std::system(command.str().c_str()) == 0) result = nlohmann::json::parse(std::ifstream(json));
  std::filesystem::remove(json);
  return result;
}

}  // namespace

int main(int argc, char** argv) {
  Report report("haptic", argc, argv);
  report.remark(
      "examples/haptic_loop, 4,000 spheres a side: a proxy is held to the hand by a virtual "
      "coupling. At every tick the overlap is asked (while stroking the distance too), and from it "
      "force and motion follow.");
  report.remark(
      "Query: from call to answer. Tick: from being woken to the force, the query within. Late: "
      "from when the tick was due to the force. All in wall time.");
  report.remark(
      "Load: a thread for every core but one, each computes and walks through 64 MB. Late ticks: "
      "the force came after the next tick was due. By work: the tick's own thread ran for longer "
      "than a period; by the timer: it was woken too late; interrupted: something else ran in its "
      "midst.");
  const double seconds = report.quick() ? 4 : 12;
  const int others = static_cast<int>(std::thread::hardware_concurrency()) - 1;

  // Parts that were baked elsewhere, for machines that have the programs alone.
  const char* const given = std::getenv("IST_HAPTIC_ASSETS");
  const std::filesystem::path folder =
      given != nullptr
          ? std::filesystem::path(given)
          : std::filesystem::temp_directory_path() / ("ist_haptic_" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  for (const Scene& scene : kScenes)
    for (const char* const name : {scene.object, scene.probe}) part(folder, name);

  struct Setup {
    int load;
    bool priority;
  };
  int failures = 0;
  bool permitted = true;
  for (const Scene& scene : kScenes)
    for (const int hz : {1000, 5000, 10000})
      for (const Setup setup : {Setup{0, false}, {others, false}, {others, true}}) {
        if (setup.priority && !permitted) continue;
        const nlohmann::json found = run(scene, folder, hz, setup.load, setup.priority, seconds);
        if (found.is_null()) {
          ++failures;
          continue;
        }
        if (setup.priority && !found.at("fifo").get<bool>()) {
          permitted = false;
          report.remark("Real-time priority was not permitted: no rows.");
          continue;
        }
        const Report::Json which = {{"scene", scene.name},
                                    {"Hz", hz},
                                    {"load", setup.load},
                                    {"real-time priority", setup.priority}};
        Report::Json times = which, late = which;
        for (const auto& [name, key] :
             {std::pair("query", "query_us"), {"tick", "tick_us"}, {"late", "late_us"}})
          for (const char* const quantile : {"p50", "p99", "p99.9", "max"})
            times[std::string(name) + " " + quantile] = found.at(key).at(quantile);
        report.row("Times, µs", times);
        late.update({{"ticks", found.at("ticks")},
                     {"in contact", found.at("in_contact")},
                     {"late", found.at("missed")},
                     {"by work", found.at("missed_by_work")},
                     {"by the timer", found.at("missed_by_timer")},
                     {"interrupted", found.at("interrupted")},
                     {"ticks skipped", found.at("skipped")},
                     {"passive", found.at("passive")}});
        report.row("Late ticks", late);
      }
  if (given == nullptr) std::filesystem::remove_all(folder);
  const int written = report.write();
  return failures > 0 ? 1 : written;
}
