#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "world.h"

class GlbWriter;

/// What a run of a scene is asked for.
struct SceneOptions {
  Way way = Way::solver;
  double hz = 240;
  double seconds = 0;            ///< [s] 0: the scene's own
  std::filesystem::path meshes;  ///< bolt.obj, nut.obj: `ist sample` writes them
  std::filesystem::path shared;  ///< of bunny_60k.ply; without it a sample stands in
  std::filesystem::path glb;     ///< written if named
  bool full = false;             ///< the long version of a scene
  bool quiet = false;
};

/// The options' way and step, and weight.
WorldSettings world_settings(const SceneOptions& options, double gravity = kGravity);

/// One number of a scene, and what it has to be.
struct Truth {
  std::string what;
  double value = 0;
  double low = 0, high = 0;  ///< it holds from low to high
  bool holds() const { return value >= low && value <= high; }
};

struct SceneResult {
  std::vector<Truth> truths;
  double steps_a_second = 0;
  double deepest = 0;         ///< [u] at any time looked at
  double kinetic_energy = 0;  ///< [mass·u²/s²] the largest in the last fifth of the run
  double size = 0;            ///< [u] of the smallest part, by which to read `deepest`
  bool works() const;         ///< every truth holds
};

struct Scene {
  const char* name;
  const char* what;
  SceneResult (*run)(const SceneOptions&);
};
const std::vector<Scene>& scenes();

/// Steps a world, looks at it, and records it: what every scene has in common.
class Run {
 public:
  Run(SceneWorld& world, const SceneOptions& options);
  ~Run();

  /// `seconds` [s] of the scene, `each` after every step.
  void go(double seconds, const std::function<void()>& each = {});
  SceneResult finish(double size, std::vector<Truth> truths);

 private:
  SceneWorld& world_;
  const SceneOptions& options_;
  std::unique_ptr<GlbWriter> glb_;
  double deepest_ = 0;
  std::vector<double> energies_;
};

SceneResult run_box(const SceneOptions&);
SceneResult run_pile(const SceneOptions&);
SceneResult run_stack(const SceneOptions&);
SceneResult run_askew(const SceneOptions&);
SceneResult run_cube_on_cube(const SceneOptions&);
SceneResult run_nut(const SceneOptions&);
SceneResult run_screw(const SceneOptions&);
SceneResult run_drop(const SceneOptions&);
SceneResult run_impacts(const SceneOptions&);
SceneResult run_heap(const SceneOptions& options);
SceneResult run_crate(const SceneOptions& options);
SceneResult run_edge(const SceneOptions& options);
SceneResult run_sensor(const SceneOptions& options);
SceneResult run_overlap(const SceneOptions&);
SceneResult run_bowl(const SceneOptions&);
SceneResult run_peg(const SceneOptions&);
SceneResult run_bunnies(const SceneOptions&);
SceneResult run_terrain(const SceneOptions&);
SceneResult run_level(const SceneOptions&);
