#pragma once

#include <ist/packing.h>
#include <ist/tree_view.h>

#include <functional>
#include <future>
#include <memory>

#include "bake/asset/asset_writer.h"
#include "mesh/mesh_solid.h"
#include "mesh/resolve/resolve.h"
#include "stage/work_stop.h"

namespace ist {

/// What an asset keeps of its solid's surface.
struct KeptSurface {
  std::shared_ptr<const FieldArrays> field;  ///< null: none
  std::shared_ptr<const MeshArrays> mesh;    ///< null: none, and `state` says why
  MeshState state = MeshState::none;
  double counted_twice = 0;  ///< unit frame, as TreeView::counted_twice
  double asked_error = 0;    ///< [u] 0: the mesh's own triangles
};

/// `resolution`: how the solid's mesh was made. `with_field`: false: the mesh alone. No field where
/// the mesh reaches far into itself, or `stop` ends it. Throws Error as build_field() does. Same
/// bytes for any number of threads.
KeptSurface keep_surface(const MeshSolid& solid, const Resolution& resolution,
                         const SurfaceSettings& settings, bool with_field,
                         const WorkStop& stop = WorkStop());

/// A solid's surface, made once on threads of its own and shared by all its assets. It ends with
/// this.
class SolidField {
 public:
  /// `threads`: 0 = all cores. `time_limit` [s] from now, after which there is no field; 0: no
  /// limit.
  SolidField(const MeshSolid& solid, const Resolution& resolution, const SurfaceSettings& settings,
             unsigned threads, double time_limit = 0)
      : solid_(solid),
        resolution_(resolution),
        settings_(settings),
        threads_(threads),
        stop_(time_limit) {}
  ~SolidField() { stop_.stop(); }
  SolidField(const SolidField&) = delete;
  SolidField& operator=(const SolidField&) = delete;

  void start();

  /// Starts it if nobody has, and asks `meanwhile` twenty times a second until it is there. Throws
  /// Error as keep_surface() does.
  KeptSurface wait(const std::function<void()>& meanwhile);

 private:
  const MeshSolid& solid_;
  const Resolution& resolution_;
  const SurfaceSettings settings_;
  const unsigned threads_;
  WorkStop stop_;
  std::shared_future<KeptSurface> made_;  ///< last: waits for the thread
};

}  // namespace ist
