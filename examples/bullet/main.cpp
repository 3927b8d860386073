// Scenes in which ist finds the contacts of Bullet's bodies, compared with Bullet's own. Headless:
// every scene prints its known values and whether they hold.
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <string>

#include "scenes/scene.h"

namespace {

int usage() {
  std::fprintf(
      stderr,
      "usage: bullet_scenes SCENE|all [--way solver|wrench|gimpact|hulls|own] [--hz F]\n"
      "         [--seconds S] [--full] [--meshes DIR] [--shared DIR] [--glb FILE] [--row]\n"
      "exits 3 where a truth does not hold. --row: one line of a table. Scenes:\n");
  for (const Scene& scene : scenes()) std::fprintf(stderr, "  %-8s %s\n", scene.name, scene.what);
  return 2;
}

/// Whether all truths hold.
bool show(const Scene& scene, const SceneOptions& options, bool row) {
  const SceneResult result = scene.run(options);
  if (row) {
    std::printf("| %s | %s | %.0f | %.0f | %.2g | %.2g | ", scene.name, name_of(options.way),
                options.hz, result.steps_a_second, result.deepest / result.size,
                result.kinetic_energy);
    if (result.works()) std::printf("yes |\n");
    for (const Truth& truth : result.truths) {
      if (!truth.holds()) std::printf("%s: %.3g; ", truth.what.c_str(), truth.value);
    }
    if (!result.works()) std::printf("no |\n");
  } else {
    std::printf("%s: %s (%s, %.0f Hz)\n", scene.name, scene.what, name_of(options.way), options.hz);
    for (const Truth& truth : result.truths) {
      std::printf("  %-5s %-46s %.5g\n", truth.holds() ? "ok" : "FALSE", truth.what.c_str(),
                  truth.value);
    }
    std::printf("        %-46s %.3g of the smallest part\n", "deepest penetration",
                result.deepest / result.size);
    std::printf("        %-46s %.3g\n", "kinetic energy in the last fifth", result.kinetic_energy);
    std::printf("        %-46s %.0f\n", "steps a second", result.steps_a_second);
  }
  std::fflush(stdout);
  return result.works();
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc < 2) return usage();
  SceneOptions options;
  if (const char* shared = std::getenv("IST_SHARED")) options.shared = shared;
  bool row = false;
  for (int i = 2; i < argc; ++i) {
    const std::string key = argv[i];
    if (key == "--row") {
      row = true;
      continue;
    }
    if (key == "--full") {
      options.full = true;
      continue;
    }
    if (i + 1 == argc) return usage();
    const std::string value = argv[++i];
    if (key == "--way") {
      if (value == "solver")
        options.way = Way::solver;
      else if (value == "wrench")
        options.way = Way::wrench;
      else if (value == "gimpact")
        options.way = Way::gimpact;
      else if (value == "hulls")
        options.way = Way::hulls;
      else if (value == "own")
        options.way = Way::own;
      else
        return usage();
    } else if (key == "--hz") {
      options.hz = std::stod(value);
    } else if (key == "--seconds") {
      options.seconds = std::stod(value);
    } else if (key == "--meshes") {
      options.meshes = value;
    } else if (key == "--shared") {
      options.shared = value;
    } else if (key == "--glb") {
      options.glb = value;
    } else {
      return usage();
    }
  }
  bool known = false, all_hold = true;
  for (const Scene& scene : scenes()) {
    if (std::strcmp(argv[1], "all") != 0 && std::strcmp(argv[1], scene.name) != 0) continue;
    known = true;
    all_hold = show(scene, options, row) && all_hold;
  }
  if (!known) return usage();
  return all_hold ? 0 : 3;
} catch (const std::exception& error) {
  std::fprintf(stderr, "bullet_scenes: %s\n", error.what());
  return 1;
}
