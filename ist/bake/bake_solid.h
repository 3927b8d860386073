#pragma once

#include <ist/bake.h>

#include <functional>
#include <future>
#include <memory>

#include "asset/asset_writer.h"
#include "backend/solid_backend.h"
#include "mesh/mesh_solid.h"
#include "stage/work_stop.h"

namespace ist {

/// A solid's field, made once on threads of its own and shared by all its assets. It ends with
/// this.
class SolidField {
 public:
  /// `threads`: 0 = all cores. `time_limit` [s] from now, after which there is none; 0: no limit.
  SolidField(const MeshSolid& solid, const FieldSettings& settings, unsigned threads,
             double time_limit = 0)
      : solid_(solid), settings_(settings), threads_(threads), stop_(time_limit) {}
  ~SolidField() { stop_.stop(); }
  SolidField(const SolidField&) = delete;
  SolidField& operator=(const SolidField&) = delete;

  void start();

  /// Starts it if nobody has, and asks `meanwhile` twenty times a second until it is there. Null:
  /// not wanted, the mesh reaches far into itself, or there was no time. Throws Error as
  /// build_field() does.
  std::shared_ptr<const FieldArrays> wait(const std::function<void()>& meanwhile);

 private:
  const MeshSolid& solid_;
  const FieldSettings settings_;
  const unsigned threads_;
  WorkStop stop_;
  std::shared_future<std::shared_ptr<const FieldArrays>> made_;  ///< last: waits for the thread
};

/// bake() of a mesh whose solid, field and backend are at hand, on the threads of the current
/// arena. The settings have been checked; where they run is the backend's affair.
Asset bake_solid(const ClosedMesh& mesh, const MeshSolid& solid, SolidField& field,
                 SolidBackend& backend, const PackingSettings& settings,
                 const ProgressCallback& progress);

/// Everything of that asset but its bytes.
AssetArrays bake_arrays(const ClosedMesh& mesh, const MeshSolid& solid, SolidField& field,
                        SolidBackend& backend, const PackingSettings& settings,
                        const ProgressCallback& progress);

}  // namespace ist
