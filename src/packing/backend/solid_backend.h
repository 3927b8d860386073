#pragma once

#include <ist/bake.h>
#include <functional>
#include <memory>

#include "packing/backend/tasks.h"

namespace ist {

/// The interface between a bake and the hardware that runs it: a solid on the host's threads or in
/// the memory of a GPU. Both give the same bits. For one thread at a time; host work runs on the
/// threads of the caller's task arena.
class SolidBackend {
 public:
  virtual ~SolidBackend() = default;

  /// Certified spheres. The settings have been validated; the backend chooses where to run.
  virtual SpherePacking pack(const PackingSettings& settings, const ProgressCallback& progress) = 0;

  /// The first round of a grid packing of a mesh. The settings have been validated.
  virtual std::vector<MedialNode> medial_nodes(const MedialSettings& settings) = 0;

  /// Relaxes sites; none if the columns cannot measure the solid. `report(part)`: the completed
  /// part, [0, 1].
  virtual RelaxedSites relax_sites(const RelaxTask& task,
                                   const std::function<void(double)>& report) = 0;

  /// The largest protrusion of the balls (unit frame) from the solid, at least 0.
  virtual double largest_protrusion(std::span<const Sphere> balls) = 0;

  /// The cover radii before rounding to float. `report(depth)`: before each level.
  virtual std::vector<double> cover_radii(const CoverTask& task,
                                          const std::function<void(int)>& report) = 0;

  /// A backend of the same kind for another solid, which must outlive it.
  virtual std::unique_ptr<SolidBackend> with(const MeshSolid& other) const = 0;

  /// Returns a maker of a backend of the same solid for another thread, which works at the same
  /// time as this one. It uses this backend's data and must not outlive it. Empty if there is none.
  virtual std::function<std::unique_ptr<SolidBackend>()> beside() { return {}; }

  /// True if the caller's threads are idle while this backend works.
  virtual bool leaves_threads_idle() const { return false; }
};

}  // namespace ist
