// Peak memory and time of the command line's whole `ist bake`, from file to file.

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>

#include "report.h"
#include "support/shared_data.h"
#include "timing.h"

namespace {

using ist::benchmark::Report;

struct Run {
  int exit_code = 1;
  double peak_gb = 0;  ///< 1e9 bytes of resident memory
  double seconds = 0;
};

Run bake(const std::filesystem::path& mesh, const std::string& spheres) {
  const std::filesystem::path out =
      std::filesystem::temp_directory_path() / ("ist_bake_memory_" + std::to_string(getpid()));
  const double start = ist::benchmark::wall_seconds();
  const pid_t child = fork();
  if (child == 0) {
    execl(IST_PROGRAM, IST_PROGRAM, "bake", mesh.c_str(), "-o", out.c_str(), "--spheres",
          spheres.c_str(), "--threads", "2", "--quiet", nullptr);
    std::_Exit(127);
  }
  int status = 0;
  rusage usage{};
  Run run;
  if (child > 0 && wait4(child, &status, 0, &usage) == child && WIFEXITED(status)) {
    run.exit_code = WEXITSTATUS(status);
  }
  run.seconds = ist::benchmark::wall_seconds() - start;
  run.peak_gb = 1024.0 * static_cast<double>(usage.ru_maxrss) / 1e9;
  std::filesystem::remove(out);
  return run;
}

}  // namespace

int main(int argc, char** argv) {
  Report report("bake_memory", argc, argv);
  report.remark(
      "`ist bake --spheres N --threads 2` as a process of its own: resident peak and wall "
      "seconds from mesh file to asset file.");
  const std::string spheres = report.quick() ? "1000" : "10000";
  const std::vector<std::string> meshes =
      report.quick() ? std::vector<std::string>{"bunny_60k.ply"}
                     : std::vector<std::string>{"bunny_60k.ply", "dragon_174k.ply",
                                                "fish_hr_539k.ply", "dragon_871k.ply"};
  int failures = 0;
  for (const std::string& mesh : meshes) {
    const Run run = bake(ist::testing::shared_path("meshes/dev/" + mesh), spheres);
    failures += run.exit_code != 0;
    report.row("Baking from file to file", {{"mesh", mesh},
                                            {"spheres", spheres},
                                            {"exit code", run.exit_code},
                                            {"seconds", run.seconds},
                                            {"peak GB", run.peak_gb}});
    if (mesh == "dragon_871k.ply" && run.exit_code == 0) {
      report.target("dragon_871k, 10000 spheres: peak GB", run.peak_gb, 2, true);
    }
  }
  const int written = report.write();
  return failures > 0 ? 1 : written;
}
