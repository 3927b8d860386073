#include "bake/backend/polygonised_backend.h"

#include "bake/backend/host_backend.h"
#include "bake/backend/pack_on_host.h"
#include "packing/cover/host_cover.h"

namespace ist {
namespace {

/// The solid by its signed distance, in the frame of the mesh and with its volume, so that one
/// frame and one volume serve all stages.
class FramedSolid final : public Solid {
 public:
  FramedSolid(const Solid& solid, const MeshSolid& mesh) : solid_(solid), mesh_(mesh) {}

  double signed_distance(const Eigen::Vector3d& x) const override {
    return solid_.signed_distance(x);
  }
  Eigen::AlignedBox3d bounds() const override { return mesh_.bounds(); }
  double volume() const override { return mesh_.volume(); }

 private:
  const Solid& solid_;
  const MeshSolid& mesh_;
};

class PolygonisedBackend final : public SolidBackend {
 public:
  PolygonisedBackend(const Solid& solid, const MeshSolid& mesh, double error)
      : solid_(solid, mesh),
        frame_(mesh.frame()),
        error_(error / frame_.scale()),
        of_mesh_(make_host_backend(mesh)) {}

  SpherePacking pack(const PackingSettings& settings, const ProgressCallback& progress) override {
    return packing::pack_on_host(solid_, settings, progress);
  }

  std::vector<MedialNode> medial_nodes(const MedialSettings& settings) override {
    return of_mesh_->medial_nodes(settings);
  }

  RelaxedSites relax_sites(const RelaxTask& task,
                           const std::function<void(double)>& report) override {
    return of_mesh_->relax_sites(task, report);
  }

  double largest_protrusion(std::span<const Sphere> balls) override {
    return of_mesh_->largest_protrusion(balls) + error_;
  }

  std::vector<double> cover_radii(const CoverTask& task,
                                  const std::function<void(int)>& report) override {
    CoverTask whole = task;
    whole.half += error_;  // the solid may reach out of the mesh's box
    return cover_on_host(solid_, frame_, whole, report);
  }

  std::unique_ptr<SolidBackend> with(const MeshSolid& other) const override {
    return of_mesh_->with(other);
  }

  std::function<std::unique_ptr<SolidBackend>()> beside() override { return {}; }

  bool leaves_threads_idle() const override { return false; }

 private:
  const FramedSolid solid_;
  const UnitFrame frame_;
  const double error_;  ///< unit frame
  const std::unique_ptr<SolidBackend> of_mesh_;
};

}  // namespace

std::unique_ptr<SolidBackend> make_polygonised_backend(const Solid& solid, const MeshSolid& mesh,
                                                       double error) {
  return std::make_unique<PolygonisedBackend>(solid, mesh, error);
}

}  // namespace ist
