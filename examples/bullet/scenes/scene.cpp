#include "scene.h"

#include <ist/bullet/convert.h>
#include <algorithm>
#include <cmath>

#include "glb_writer.h"

const std::vector<Scene>& scenes() {
  static const std::vector<Scene> all = {
      {"box", "a cube comes to rest on a plane", run_box},
      {"pile", "cubes fall in a heap on a plane", run_pile},
      {"stack", "ten cubes stand on each other", run_stack},
      {"askew", "ten cubes stand on each other, each a little off and turned", run_askew},
      {"cube", "a cube comes to rest on a cube", run_cube_on_cube},
      {"nut", "a nut turns down a bolt by its weight", run_nut},
      {"screw", "a screw falls on a table a hundred times its size", run_screw},
      {"drop", "eight screws fall on a thin plate", run_drop},
      {"impacts", "five solids fall on a plane at every turn", run_impacts},
      {"heap", "a hundred solids fall into a crate", run_heap},
      {"crate", "the same with ist::Scene as the broad phase of Bullet's world", run_crate},
      {"edge", "boxes lie over a table's edge", run_edge},
      {"sensor", "a box falls through a sensor", run_sensor},
      {"overlap", "five boxes that begin in each other", run_overlap},
      {"bowl", "a ball in a bowl in a box", run_bowl},
      {"peg", "a peg slips into a hole with 0.1 mm of clearance", run_peg},
      {"bunnies", "thirty bunnies in a crate", run_bunnies},
      {"terrain", "tori, balls and cubes in a hollow with a boulder", run_terrain},
      {"level", "the same on a triangle mesh", run_level},
  };
  return all;
}

WorldSettings world_settings(const SceneOptions& options, double gravity) {
  WorldSettings settings;
  settings.way = options.way;
  settings.step = 1 / options.hz;
  settings.gravity = {0, 0, -gravity};
  return settings;
}

bool SceneResult::works() const {
  return std::all_of(truths.begin(), truths.end(), [](const Truth& t) { return t.holds(); });
}

Run::Run(SceneWorld& world, const SceneOptions& options) : world_(world), options_(options) {
  if (!options.glb.empty()) glb_ = std::make_unique<GlbWriter>(world);
}
Run::~Run() = default;

void Run::go(double seconds, const std::function<void()>& each) {
  const double end = world_.time() + seconds;
  while (world_.time() < end - 0.5 * world_.settings().step) {
    if (glb_) glb_->record(world_);
    world_.step();
    energies_.push_back(world_.kinetic_energy());
    // Every sixteenth of a second is enough to see what has gone through.
    if (std::fmod(world_.time(), 1.0 / 16) < world_.settings().step) {
      deepest_ = std::max(deepest_, world_.deepest_penetration());
    }
    if (each) each();
  }
}

SceneResult Run::finish(double size, std::vector<Truth> truths) {
  SceneResult result;
  result.truths = std::move(truths);
  result.steps_a_second = world_.steps_a_second();
  result.deepest = std::max(deepest_, world_.deepest_penetration());
  const std::size_t last = energies_.size() / 5;
  for (std::size_t i = energies_.size() - last; i < energies_.size(); ++i) {
    // A world that has blown up is no world at rest.
    const double e = std::isfinite(energies_[i]) ? energies_[i] : 1e300;
    result.kinetic_energy = std::max(result.kinetic_energy, e);
  }
  result.size = size;
  if (glb_) glb_->write(options_.glb);
  return result;
}
