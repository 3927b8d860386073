// The scenes of examples/bullet: patches in Bullet's solver and GImpact by turns, then convex hulls
// and the wrench. Each run is a process of its own with a limit on its processor time.

#include <poll.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <thread>

#include "report.h"
#include "scenes/scene.h"
#include "support/shared_data.h"

namespace {

using ist::benchmark::Report;
using Json = Report::Json;

/// JSON has no infinity: a world that blew up has gone as far as this.
double finite(double x) { return std::isfinite(x) ? std::clamp(x, -1e300, 1e300) : 1e300; }

Json told(const SceneResult& result) {
  Json truths = Json::array();
  for (const Truth& truth : result.truths) {
    truths.push_back({{"what", truth.what},
                      {"low", truth.low},
                      {"high", truth.high},
                      {"value", finite(truth.value)},
                      {"holds", truth.holds()}});
  }
  return {{"works", result.works()},
          {"steps", finite(result.steps_a_second)},
          {"deepest", finite(result.deepest / result.size)},
          {"energy", finite(result.kinetic_energy)},
          {"truths", truths}};
}

/// Work in a process of its own. This process has no thread yet, so that it may fork.
class Apart {
 public:
  /// `limit` [s] of processor time: 0 for none.
  template <class Work>
  Apart(const std::string& name, unsigned limit, const Work& work) {
    int ends[2];
    if (pipe(ends) != 0) return;
    child_ = fork();
    if (child_ == 0) {
      close(ends[0]);
      const rlimit most{limit, limit};
      if (limit > 0) setrlimit(RLIMIT_CPU, &most);
      int code = 1;
      try {
        const std::string text = work().dump();
        const ssize_t written = write(ends[1], text.data(), text.size());
        code = written == static_cast<ssize_t>(text.size()) ? 0 : 1;
      } catch (const std::exception& error) {
        std::cerr << name << ": " << error.what() << "\n";
      }
      _exit(code);
    }
    close(ends[1]);
    end_ = ends[0];
  }

  /// Waits until one of those that run has something to tell, or has ended.
  static std::size_t first_done(const std::vector<std::optional<Apart>>& all) {
    std::vector<pollfd> ends;
    for (const std::optional<Apart>& one : all) ends.push_back({one ? one->end_ : -1, POLLIN, 0});
    poll(ends.data(), ends.size(), -1);
    const auto ready = [](const pollfd& end) { return end.revents != 0; };
    return static_cast<std::size_t>(std::find_if(ends.begin(), ends.end(), ready) - ends.begin());
  }

  /// What it has to tell; nothing if it was not done in time, or failed. Once.
  std::optional<Json> wait() const {
    if (child_ < 0) return std::nullopt;
    std::string text;
    std::array<char, 4096> part;
    for (ssize_t n; (n = read(end_, part.data(), part.size())) > 0;)
      text.append(part.data(), static_cast<std::size_t>(n));
    close(end_);
    int status = 0;
    waitpid(child_, &status, 0);
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) return std::nullopt;
    return Json::parse(text);
  }

 private:
  pid_t child_ = -1;
  int end_ = -1;
};

/// Decomposition and bakes included in the limit [s].
std::optional<Json> run_apart(const Scene& scene, const SceneOptions& options, unsigned limit) {
  return Apart(scene.name, limit, [&] { return told(scene.run(options)); }).wait();
}

/// The faster of both: other programs only ever take time.
void keep_faster(std::optional<Json>& best, const std::optional<Json>& other) {
  if (other && (!best || best->at("steps") < other->at("steps"))) best = other;
}

std::string said(const std::optional<Json>& run, unsigned limit) {
  if (!run) return "failed, or not done in " + std::to_string(limit) + " s";
  if (run->at("works")) return "yes";
  for (const Json& truth : run->at("truths")) {
    if (!truth.at("holds")) return "no: " + truth.at("what").get<std::string>();
  }
  return "no";
}

/// [Hz] that the wrench in the tick needs.
double steps_of_wrench(const Scene& scene) { return std::string(scene.name) == "nut" ? 1000 : 240; }

double rounded(double x, double to) { return to * std::round(x / to); }

}  // namespace

int main(int argc, char** argv) {
  Report report("bullet_scenes", argc, argv);
  report.page("Scenes in Bullet");
  report.remark(
      "Steps a second of stepSimulation() alone, by processor time, at 240 Hz, the fastest of the "
      "turns; ist (patches in the solver) and GImpact by turns, each run a process of its own, as "
      "many scenes at a time as a third of the cores (quick: as all of them). Works: every truth "
      "of the scene holds; else the first that does not.");
  report.remark(
      "Not done: not in the limit of processor time, bakes and decomposition included. At four "
      "rates: who is not done at one is not asked at the next ones.");
  report.remark("Deepest: of the smallest part. Energy: kinetic, the largest in the last fifth.");

  const std::filesystem::path meshes =
      std::filesystem::temp_directory_path() / ("ist_scenes_" + std::to_string(getpid()));
  std::filesystem::create_directory(meshes);
  for (const std::string name : {"bolt", "nut", "torus_knot"}) {
    const std::string command = "'" IST_PROGRAM "' sample " + name + " -o '" +
                                (meshes / (name + ".obj")).string() + "' 1>&2";
    if (std::system(command.c_str()) != 0) return 1;
  }

  const int turns = report.quick() ? 1 : 3;
  const unsigned limit = report.quick() ? 15 : 45;
  SceneOptions options;
  options.meshes = meshes;
  options.shared = ist::testing::shared_path("");
  // All runs of a scene, one after another.
  const auto all_ways = [&](const Scene& scene) {
    const auto run = [&](Way way, double hz = 240) {
      SceneOptions of_way = options;
      of_way.way = way;
      of_way.hz = hz;
      return run_apart(scene, of_way, limit);
    };
    std::optional<Json> ist, gimpact;
    for (int turn = 0; turn < turns; ++turn) {
      keep_faster(ist, run(Way::solver));
      if (turn == 0 || gimpact) keep_faster(gimpact, run(Way::gimpact));
    }
    const double wrench_hz = steps_of_wrench(scene);
    Json told_of = Json::object();
    const auto tell = [&](const char* way, const std::optional<Json>& result) {
      if (result) told_of[way] = *result;
    };
    tell("ist", ist);
    tell("gimpact", gimpact);
    tell("hulls", run(Way::hulls));
    tell("wrench", run(Way::wrench, wrench_hz));
    return told_of;
  };
  // At 60 Hz a body is up to its own size deep when it is first met.
  const auto all_rates = [&](const Scene& scene) {
    SceneOptions of_run = options;
    of_run.full = !report.quick();
    Json rows = Json::array();
    for (const Way way : {Way::solver, Way::own, Way::hulls, Way::gimpact}) {
      const unsigned times = !report.quick() ? 10 : way == Way::gimpact ? 1 : 4;
      for (const double hz : {60, 120, 240, 1000}) {
        of_run.hz = hz;
        of_run.way = way;
        const std::optional<Json> result = run_apart(scene, of_run, times * limit);
        if (!result) break;
        rows.push_back({{"way", name_of(way)}, {"Hz", hz}, {"result", *result}});
      }
    }
    return rows;
  };
  struct Job {
    const Scene* scene;
    bool rates;
  };
  std::vector<Job> jobs;  // the longest ones first
  for (const std::string name : {"heap", "impacts", "edge", "sensor"})
    for (const Scene& scene : scenes())
      if (name == scene.name) jobs.push_back({&scene, true});
  const std::size_t of_rates = jobs.size();
  for (const Scene& scene : scenes()) jobs.push_back({&scene, false});
  const std::size_t cores = std::max(1u, std::thread::hardware_concurrency());
  const std::size_t at_once = std::max(std::size_t{1}, report.quick() ? cores : cores / 3);
  std::vector<Json> done(jobs.size());
  std::vector<std::optional<Apart>> running(jobs.size());
  const auto finish_one = [&] {
    const std::size_t first = Apart::first_done(running);
    done[first] = running[first]->wait().value_or(Json::object());
    running[first].reset();
  };
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    if (i >= at_once) finish_one();
    const Scene& scene = *jobs[i].scene;
    running[i].emplace(scene.name, 0,
                       [&] { return jobs[i].rates ? all_rates(scene) : all_ways(scene); });
  }
  for (std::size_t i = 0; i < std::min(at_once, jobs.size()); ++i) finish_one();
  const std::vector<Json> results(done.begin() + static_cast<std::ptrdiff_t>(of_rates), done.end());

  bool all_work = true;
  for (std::size_t i = 0; i < results.size(); ++i) {
    const Scene& scene = scenes()[i];
    const auto of = [&](const char* way) {
      return results[i].contains(way) ? std::optional<Json>(results[i].at(way)) : std::nullopt;
    };
    const std::optional<Json> ist = of("ist"), gimpact = of("gimpact"), hulls = of("hulls"),
                              wrench = of("wrench");
    const bool at_1000 = steps_of_wrench(scene) == 1000;

    Json row = {{"scene", scene.name}, {"ist works", said(ist, limit)}};
    if (ist) row["ist, steps a second"] = rounded(ist->at("steps"), 10);
    row["GImpact works"] = said(gimpact, limit);
    if (gimpact) row["GImpact, steps a second"] = rounded(gimpact->at("steps"), 10);
    if (ist && gimpact) {
      const double ratio = ist->at("steps").get<double>() / gimpact->at("steps").get<double>();
      row["ist over GImpact"] = ratio;
      if (gimpact->at("works")) {
        report.target(std::string(scene.name) + ": steps a second over GImpact's", ratio, 1);
      }
    }
    row["hulls work"] = have_hulls() ? said(hulls, limit) : "not asked: ./dev setup --bullet";
    row["wrench works"] = said(wrench, limit) + (at_1000 ? ", at 1 kHz" : "");
    report.row("Scenes", row);

    using Named = std::pair<const char*, const std::optional<Json>*>;
    for (const auto& [name, result] : {Named{"ist", &ist}, Named{"GImpact", &gimpact},
                                       Named{"hulls", &hulls}, Named{"wrench", &wrench}}) {
      if (!*result) continue;
      report.row("What the bodies did", {{"scene", scene.name},
                                         {"way", name},
                                         {"deepest", (*result)->at("deepest")},
                                         {"energy", (*result)->at("energy")}});
    }
    if (ist) {
      for (const Json& truth : ist->at("truths")) {
        Json told_of = {{"scene", scene.name}, {"truth", truth.at("what")}};
        if (truth.at("low") > -1e299) told_of["from"] = truth.at("low");
        told_of["to"] = truth.at("high");
        told_of["found"] = truth.at("value");
        report.row("Truths, ist", told_of);
      }
    }
    all_work = all_work && ist && ist->at("works").get<bool>();
  }
  for (std::size_t i = 0; i < of_rates; ++i) {
    const std::string name = jobs[i].scene->name;
    std::size_t ours = 0;
    for (const Json& run : done[i]) {
      const Json& result = run.at("result");
      Json row = {{"way", run.at("way")}, {"Hz", run.at("Hz")}};
      for (const Json& truth : result.at("truths"))
        row[truth.at("what").get<std::string>()] = truth.at("value");
      row["steps a second"] = rounded(result.at("steps"), 1);
      report.row(name, row);
      if (run.at("way") != name_of(Way::solver)) continue;
      ++ours;
      if (name != "heap") all_work = all_work && result.at("works").get<bool>();
    }
    all_work = all_work && ours == 4;
  }
  std::filesystem::remove_all(meshes);
  const int written = report.write();
  return all_work ? written : 1;
}
