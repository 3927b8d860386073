#include "bake/kept_surface.h"

#include <tbb/parallel_invoke.h>

#include <cmath>
#include <optional>
#include <utility>

#include "bake/field/field.h"
#include "bake/field/mesh_blocks.h"
#include "stage/aside.h"

namespace ist {
namespace {

/// Of a mesh that could not be resolved. Unit frame: ∫ |w − [w ≥ 1]| of the winding number w, as
/// far as its signs are one. 0: the mesh is the boundary of its solid, but for faces that touch.
double estimate_counted_twice(const MeshSolid& solid) {
  constexpr double kNothing = 1e-9;  // of the volume: what rounding makes of faces that touch
  if (!solid.may_overlap()) return 0;
  const double more = std::abs(enclosed_moments(solid.arrays()).volume - solid.unit_volume());
  return more > kNothing * solid.unit_volume() ? more : 0;
}

std::shared_ptr<const MeshArrays> own_mesh(const MeshSolid& solid, const Resolution& resolution) {
  MeshArrays mesh = lay_out_mesh(solid.arrays());
  mesh.header.rounding = solid.rounding() + resolution.moved / solid.frame().scale();
  return std::make_shared<const MeshArrays>(std::move(mesh));
}

/// The triangles of a field over the doubles that its floats are.
std::shared_ptr<const MeshArrays> mesh_of(const BuiltField& field) {
  std::vector<double> vertices;
  vertices.reserve(3 * field.mesh.vertices.size());
  for (const FieldMesh::Vertex& v : field.mesh.vertices)
    vertices.insert(vertices.end(), v.begin(), v.end());
  MeshView view;
  view.vertices = vertices.data();
  view.triangles = field.mesh.triangles.front().data();
  view.vertex_count = static_cast<std::uint32_t>(field.mesh.vertices.size());
  view.triangle_count = static_cast<std::uint32_t>(field.mesh.triangles.size());
  MeshArrays mesh = lay_out_mesh(view);
  mesh.header.error = field.arrays.header.error;
  return std::make_shared<const MeshArrays>(std::move(mesh));
}

std::optional<BuiltField> field_in_time(const MeshSolid& solid, double error,
                                        const WorkStop& stop) {
  try {
    return build_field(solid, error, stop);
  } catch (const WorkStop::Stopped&) {
    return std::nullopt;
  }
}

}  // namespace

KeptSurface keep_surface(const MeshSolid& solid, const Resolution& resolution,
                         const SurfaceSettings& settings, bool with_field, const WorkStop& stop) {
  KeptSurface kept;
  if (!settings.wanted) return kept;
  kept.asked_error =
      settings.error > 0 ? settings.error : settings.share * solid.bounds().sizes().maxCoeff();
  const double error = kept.asked_error / solid.frame().scale();
  std::optional<BuiltField> field;
  const auto find_field = [&] {
    if (with_field || error > 0) field = field_in_time(solid, error, stop);
  };
  const auto find_mesh = [&] {
    using How = Resolution::How;
    const double scale = solid.frame().scale();
    kept.counted_twice = resolution.how == How::unresolved
                             ? estimate_counted_twice(solid)
                             : resolution.counted_twice / (scale * scale * scale);
    kept.state = resolution.how == How::resolved ? MeshState::resolved : MeshState::own;
    if (resolution.how == How::unresolved && kept.counted_twice > 0)
      kept.state = MeshState::unresolved;
    if (kept.state != MeshState::unresolved && error == 0) kept.mesh = own_mesh(solid, resolution);
  };
  tbb::parallel_invoke(find_field, find_mesh);
  if (kept.state != MeshState::unresolved && error > 0) {
    const bool all = !field || field->own;
    kept.mesh = all ? own_mesh(solid, resolution) : mesh_of(*field);
    if (!all) kept.state = MeshState::simplified;
  }
  if (with_field && field) kept.field = std::make_shared<FieldArrays>(std::move(field->arrays));
  return kept;
}

void SolidField::start() {
  if (made_.valid()) return;
  made_ = do_aside(threads_, [this] {
            return keep_surface(solid_, resolution_, settings_, true, stop_);
          }).share();
}

KeptSurface SolidField::wait(const std::function<void()>& meanwhile) {
  start();
  wait_for(made_, meanwhile);
  return made_.get();
}

}  // namespace ist
