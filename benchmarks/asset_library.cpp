// Libraries of assets, from mesh files to .ist files by `ist bake --manifest`: assets a second on
// the GPU and on the CPU, with memory, a kill half-way and a restart; and meshes one at a time.

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <thread>
#include <vector>

#include <ist/gpu.h>
#include <ist/mesh.h>

#include "mesh/samples/samples.h"
#include "report.h"
#include "support/shared_data.h"

namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;
using ist::benchmark::Report;
using Json = Report::Json;

/// Every triangle in four.
ist::TriangleMesh finer(const ist::TriangleMesh& mesh) {
  ist::TriangleMesh out;
  out.vertices = mesh.vertices;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
  const auto middle = [&](std::uint32_t a, std::uint32_t b) {
    const auto [found, added] =
        middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(out.vertices.size()));
    if (added) out.vertices.emplace_back((out.vertices[a] + out.vertices[b]) / 2);
    return found->second;
  };
  for (const auto& [a, b, c] : mesh.triangles) {
    const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    out.triangles.insert(out.triangles.end(),
                         {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
  }
  return out;
}

/// Another shape for each number: stretched along the axes, and twisted about z a little.
void deform(ist::TriangleMesh& mesh, std::size_t number) {
  const auto part = [&](double step) { return std::fmod(static_cast<double>(number) * step, 1.0); };
  const Vector3d stretch(0.7 + 0.6 * part(0.618034), 0.7 + 0.6 * part(0.414214),
                         0.7 + 0.6 * part(0.732051));
  const double twist = 0.03 * (part(0.236068) - 0.5);  // [rad/u]
  for (Vector3d& v : mesh.vertices) {
    const double c = std::cos(twist * v.z()), s = std::sin(twist * v.z());
    v = Vector3d(c * v.x() - s * v.y(), s * v.x() + c * v.y(), v.z()).cwiseProduct(stretch);
  }
}

void write_ply(const ist::TriangleMesh& mesh, const fs::path& path) {
  std::ofstream file(path, std::ios::binary);
  file << "ply\nformat binary_little_endian 1.0\nelement vertex " << mesh.vertices.size()
       << "\nproperty float x\nproperty float y\nproperty float z\nelement face "
       << mesh.triangles.size() << "\nproperty list uchar int vertex_indices\nend_header\n";
  std::string bytes;
  for (const Vector3d& v : mesh.vertices) {
    const std::array<float, 3> at = {static_cast<float>(v.x()), static_cast<float>(v.y()),
                                     static_cast<float>(v.z())};
    bytes.append(reinterpret_cast<const char*>(at.data()), sizeof(at));
  }
  for (const auto& t : mesh.triangles) {
    bytes.push_back(3);
    bytes.append(reinterpret_cast<const char*>(t.data()), sizeof(t));
  }
  file << bytes;
  if (!file.flush()) throw std::runtime_error("cannot write " + path.string());
}

/// Bakes a manifest into `out` as a user would.
class Bake {
 public:
  /// `cards`: how many GPUs it sees; 0: all.
  Bake(const fs::path& folder, std::vector<std::string> options, int cards = 0) {
    std::vector<std::string> arguments = {IST_PROGRAM, "bake", "--manifest", "library.toml",
                                          "-o",        "out",  "--quiet",    "--json"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    start_ = std::chrono::steady_clock::now();
    child_ = fork();
    if (child_ != 0) return;
    if (cards == 1) setenv("CUDA_VISIBLE_DEVICES", "0", 1);
    if (chdir(folder.c_str()) != 0 || std::freopen("summary.json", "w", stdout) == nullptr)
      _exit(126);
    execv(argv[0], argv.data());
    _exit(127);
  }

  void kill() const { ::kill(child_, SIGKILL); }

  /// [MB] that it holds now; 0 once it has ended.
  double memory_now_mb() const {
    std::ifstream file("/proc/" + std::to_string(child_) + "/statm");
    double size = 0, resident = 0;
    file >> size >> resident;
    return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / (1 << 20);
  }

  /// Throws if it failed, unless it was killed.
  void wait() {
    int status = 0;
    rusage used{};
    wait4(child_, &status, 0, &used);
    seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    memory_mb = static_cast<double>(used.ru_maxrss) / 1024;
    if (!WIFSIGNALED(status) && WEXITSTATUS(status) != 0)
      throw std::runtime_error("ist bake --manifest failed");
  }

  double seconds = 0, memory_mb = 0;

 private:
  pid_t child_;
  std::chrono::steady_clock::time_point start_;
};

std::string mesh_name(std::size_t number) {
  return std::string("meshes/m").append(std::to_string(number)).append(".ply");
}

std::size_t files_in(const fs::path& folder) {
  std::size_t count = 0;
  if (fs::exists(folder))
    for (const auto& entry : fs::directory_iterator(folder))
      count += entry.path().extension() == ".ist" ? 1 : 0;
  return count;
}

/// What the last run's summary says of each asset.
std::vector<Json> results(const fs::path& folder) {
  std::ifstream file(folder / "summary.json");
  return Json::parse(file).at("assets").get<std::vector<Json>>();
}

void write_manifest(const fs::path& folder, std::size_t spheres, const std::string& assets) {
  std::ofstream(folder / "library.toml") << "[defaults]\nspheres = " << spheres << "\n" << assets;
}

}  // namespace

int main(int argc, char** argv) {
  std::size_t restarted = 0;
  Report report("asset_library", argc, argv, {{"assets", restarted}});
  report.page("Libraries of assets");
  report.remark(
      "Meshes: gear, bolt, nut and torus_knot of `ist sample`, cut finer, each stretched and "
      "twisted in its own way; 17,000 to 38,000 triangles in binary PLY. Time is that of the whole "
      "`ist bake --manifest`, from its start to its end.");
  report.remark(
      "Restarted: killed with SIGKILL once half of the assets are there, started again with the "
      "same cache; time and assets of both runs. `--assets N` says how many.");
  const fs::path folder = fs::temp_directory_path() / ("ist_library_" + std::to_string(getpid()));
  fs::create_directories(folder / "meshes");
  const std::size_t count = report.quick() ? 8 : 400;
  const std::size_t few = std::min<std::size_t>(count, 40);
  if (restarted == 0) restarted = std::max(few, count / 10);
  const std::size_t meshes = std::max(count, restarted);
  std::vector<ist::TriangleMesh> kinds;
  for (const auto& [name, cuts] :
       {std::pair("gear", 2), {"bolt", 1}, {"nut", 2}, {"torus_knot", 0}}) {
    kinds.push_back(ist::make_sample(name));
    for (int k = 0; k < cuts; ++k) kinds.back() = finer(kinds.back());
  }
  {
    std::vector<std::thread> threads;
    const std::size_t workers = std::thread::hardware_concurrency();
    for (std::size_t w = 0; w < workers; ++w)
      threads.emplace_back([&, w] {
        for (std::size_t i = w; i < meshes; i += workers) {
          ist::TriangleMesh mesh = kinds[i % kinds.size()];
          deform(mesh, i);
          write_ply(mesh, folder / mesh_name(i));
        }
      });
    for (std::thread& thread : threads) thread.join();
  }
  const std::vector<std::string> devices = ist::gpu_available()
                                               ? std::vector<std::string>{"cuda", "cpu"}
                                               : std::vector<std::string>{"cpu"};
  const auto assets_of = [](std::size_t n) {
    std::ostringstream out;
    for (std::size_t i = 0; i < n; ++i) out << "[[asset]]\nmesh = \"" << mesh_name(i) << "\"\n";
    return out.str();
  };
  for (const std::string& device : devices) {
    // The CPU is slow enough to be measured on fewer.
    const std::size_t some = device == "cuda" ? count : few;
    for (const std::size_t spheres : {std::size_t{4000}, std::size_t{1000}}) {
      const std::size_t n = spheres == 4000 ? some : std::max(few, some / 5);
      write_manifest(folder, spheres, assets_of(n));
      fs::remove_all(folder / "out");
      Bake bake(folder, {"--device", device});
      bake.wait();
      const double rate = static_cast<double>(n) / bake.seconds;
      report.row("Whole libraries", {{"device", device == "cuda" ? ist::gpu_info().name : "CPU"},
                                     {"spheres", spheres},
                                     {"assets", files_in(folder / "out")},
                                     {"seconds", bake.seconds},
                                     {"assets a second", rate},
                                     {"peak memory [MB]", bake.memory_mb}});
      if (device == "cuda" && spheres == 4000)
        report.target("assets a second on the GPU, 4,000 spheres", rate, 25);
    }
  }

  std::string why;
  if (devices[0] == "cuda" && ist::gpu_available(1, &why)) {
    // The same library by one card and by all of them, every core of the machine for either.
    write_manifest(folder, 4000, assets_of(count));
    double rates[2] = {};
    for (const int cards : {1, 0}) {
      fs::remove_all(folder / "out");
      Bake bake(folder, {"--device", "cuda"}, cards);
      bake.wait();
      rates[cards] = static_cast<double>(count) / bake.seconds;
      report.row("Cards", {{"cards", cards == 1 ? "one" : "all"},
                           {"spheres", 4000},
                           {"assets", count},
                           {"seconds", bake.seconds},
                           {"assets a second", rates[cards]},
                           {"peak memory [MB]", bake.memory_mb}});
    }
    report.target("all cards over one", rates[0] / rates[1], 1.8);
  }

  write_manifest(folder, 4000, assets_of(restarted));
  fs::remove_all(folder / "out");
  std::vector<double> memory;
  const auto watch = [&](const Bake& bake, std::size_t until) {
    std::size_t next = files_in(folder / "out") + restarted / 10;
    for (std::size_t there = 0; there < until; usleep(50'000)) {
      there = files_in(folder / "out");
      if (there < next) continue;
      memory.push_back(bake.memory_now_mb());
      next += restarted / 10;
    }
  };
  Bake first(folder, {"--device", devices[0], "--cache", "cache"});
  watch(first, restarted / 2);
  first.kill();
  first.wait();
  const std::size_t before = files_in(folder / "out");
  Bake second(folder, {"--device", devices[0], "--cache", "cache"});
  watch(second, restarted - 1);
  second.wait();
  std::size_t kept = 0;
  for (const Json& asset : results(folder)) kept += asset.at("status") == "cached" ? 1 : 0;
  report.row("Restarted", {{"assets", restarted},
                           {"spheres", 4000},
                           {"there when killed", before},
                           {"from the cache", kept},
                           {"seconds until killed", first.seconds},
                           {"seconds after", second.seconds},
                           {"assets a second",
                            static_cast<double>(restarted) / (first.seconds + second.seconds)},
                           {"assets at the end", files_in(folder / "out")},
                           {"memory at every tenth [MB]", memory}});

  // One mesh at a time, from its file to its asset; the process is warm after the first.
  struct Alone {
    const char* file;
    std::size_t spheres;
    double most_ms;
  };
  std::vector<Alone> alone = {{"oracle/meshes/dino.off", 4000, 40}};
  if (!report.quick())
    alone.insert(alone.end(), {{"oracle/meshes/dino.off", 10'000, 60},
                               {"meshes/dev/dragon_871k.ply", 10'000, 150}});
  for (const Alone& one : alone) {
    const fs::path path = ist::testing::shared_path(one.file);
    if (!fs::exists(path)) continue;
    std::ostringstream assets;
    for (int seed = 0; seed < (report.quick() ? 3 : 9); ++seed)
      assets << "[[asset]]\nmesh = \"" << path.string() << "\"\nname = \"a" << seed
             << "\"\nseed = " << seed << "\n";
    for (const std::string& device : devices) {
      if (device == "cpu" && devices.size() > 1 && one.spheres > 4000) continue;
      write_manifest(folder, one.spheres, assets.str());
      fs::remove_all(folder / "out");
      Bake bake(folder, {"--device", device, "--jobs", "1"});
      bake.wait();
      std::vector<double> ms;
      for (const Json& asset : results(folder))
        ms.push_back(1e3 * asset.at("seconds").get<double>());
      ms.erase(ms.begin());
      std::sort(ms.begin(), ms.end());
      report.row("One at a time", {{"mesh", path.stem().string()},
                                   {"spheres", one.spheres},
                                   {"device", device == "cuda" ? ist::gpu_info().name : "CPU"},
                                   {"file to file, median [ms]", ms[ms.size() / 2]},
                                   {"least", ms.front()},
                                   {"most", ms.back()}});
      if (device == "cuda")
        report.target(path.stem().string() + ", " + std::to_string(one.spheres) +
                          " spheres, file to file [ms]",
                      ms[ms.size() / 2], one.most_ms, true);
    }
  }
  fs::remove_all(folder);
  return report.write();
}
