#include "bake/backend/host_backend.h"

#include <ist/error.h>

#include "bake/backend/pack_on_host.h"
#include "packing/calibrate/host_calibration.h"
#include "packing/cover/host_cover.h"
#include "packing/grids/host_rounds.h"
#include "packing/grids/medial_grids.h"

namespace ist {
namespace {

class HostBackend final : public SolidBackend {
 public:
  explicit HostBackend(const Solid& solid) : solid_(solid) {}

  SpherePacking pack(const PackingSettings& settings, const ProgressCallback& progress) override {
    return packing::pack_on_host(solid_, settings, progress);
  }

  std::vector<MedialNode> medial_nodes(const MedialSettings& settings) override {
    return packing::medial_nodes_by(packing::HostRounds(mesh().arrays()), mesh(), settings);
  }

  RelaxedSites relax_sites(const RelaxTask& task,
                           const std::function<void(double)>& report) override {
    return relax_on_host(mesh(), task, report);
  }

  double largest_protrusion(std::span<const Sphere> balls) override {
    return protrusion_on_host(mesh(), balls);
  }

  std::vector<double> cover_radii(const CoverTask& task,
                                  const std::function<void(int)>& report) override {
    return cover_on_host(mesh(), task, report);
  }

  std::unique_ptr<SolidBackend> with(const MeshSolid& other) const override {
    return make_host_backend(other);
  }

  std::function<std::unique_ptr<SolidBackend>()> beside() override { return {}; }

  bool leaves_threads_idle() const override { return false; }

 private:
  const MeshSolid& mesh() const {
    if (solid_.mesh() == nullptr)
      throw Error(
          "grids, cells and covers need a mesh, and this solid is not one; use the banded mode");
    return *solid_.mesh();
  }

  const Solid& solid_;
};

}  // namespace

std::unique_ptr<SolidBackend> make_host_backend(const Solid& solid) {
  return std::make_unique<HostBackend>(solid);
}

}  // namespace ist
