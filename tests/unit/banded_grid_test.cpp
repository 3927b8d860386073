#include "cuda/packing/banded/banded_loop.h"

#include <gtest/gtest.h>
#include <ist/bake.h>

#include <memory>
#include <vector>

#include "cuda/packing/banded/banded_buffers.h"
#include "mesh/samples/samples.h"
#include "packing/banded/mesh_surface.h"
#include "packing/base/packing_settings.h"
#include "support/host_coop_launch.h"
#include "support/same_packing.h"
#include "support/test_meshes.h"

// The GPU's banded packing, run by a cooperative launch of host threads: the same spheres as the
// CPU's packer, whatever the number of teams and however small its arrays are at first.

namespace ist::testing {
namespace {

struct Host {};

/// Stands in for a DeviceArray.
template <class T>
class HostArray {
 public:
  HostArray() = default;
  HostArray(Host&, std::size_t size) : data_(new T[size]), size_(size) {
    std::memset(static_cast<void*>(data_.get()), 0xA5, size * sizeof(T));
  }
  T* data() const { return data_.get(); }
  std::size_t size() const { return size_; }
  void fill_bytes(int value) {
    std::memset(static_cast<void*>(data_.get()), value, size_ * sizeof(T));
  }
  void upload(std::span<const T> from) { std::copy(from.begin(), from.end(), data_.get()); }
  std::vector<T> to_host(std::size_t count) const { return {data_.get(), data_.get() + count}; }
  void grow(std::size_t size, std::size_t kept) {
    Host host;
    HostArray larger(host, size);
    std::copy(data_.get(), data_.get() + kept, larger.data());
    *this = std::move(larger);
  }
  void release() { *this = HostArray(); }

 private:
  std::unique_ptr<T[]> data_;
  std::size_t size_ = 0;
};

struct GridOfTeams {
  SpherePacking packing;
  gpu::BandedState state;
  int launches = 0;
};

GridOfTeams pack_by_grid(const MeshSolid& solid, const PackingSettings& settings,
                         std::uint32_t teams, const gpu::BandedSizes& sizes,
                         std::uint32_t many = gpu::BandedArrays::kMany) {
  const packing::MeshSurface surface(solid);
  Host host;
  gpu::BandedBuffers<HostArray, Host> buffers(
      host, packing::BandSchedule(packing::packing_limits(solid, solid.frame().scale(), settings)),
      sizes);
  GridOfTeams out;
  for (;;) {
    gpu::BandedArrays arrays = buffers.arrays();
    arrays.many = many;
    run_launch<packing::CellScratch<std::uint32_t>>(
        teams, [&](auto& coop) { gpu::pack_banded(coop, arrays, surface); });
    ++out.launches;
    out.state = buffers.state();
    if (out.state.need == gpu::Need::nothing) break;
    buffers.provide(out.state);
  }
  out.packing = buffers.result(out.state);
  return out;
}

TEST(BandedGrid, PacksLikeTheCpuWhateverItsSize) {
  for (const char* name : {"bolt", "gear"}) {
    const MeshSolid solid(close_mesh(make_sample(name), name));
    for (const unsigned count : {30u, 300u, 2000u}) {
      PackingSettings settings;
      settings.max_spheres = count;
      const SpherePacking expected = pack(solid, settings);
      for (const std::uint32_t teams : {1u, 3u}) {
        SCOPED_TRACE(std::string(name) + " " + std::to_string(count) + " by " +
                     std::to_string(teams));
        const GridOfTeams got =
            pack_by_grid(solid, settings, teams, gpu::banded_sizes(settings.max_spheres));
        expect_same(got.packing, expected);
      }
    }
  }
}

TEST(BandedGrid, WorkInPartsIsTheSameWork) {
  const MeshSolid solid(close_mesh(make_sample("bolt"), "bolt"));
  for (const unsigned count : {100u, 1000u}) {
    PackingSettings settings;
    settings.max_spheres = count;
    const SpherePacking expected = pack(solid, settings);
    for (const std::uint32_t many : {1u, 100u}) {
      SCOPED_TRACE(std::to_string(count) + " in parts from " + std::to_string(many));
      expect_same(pack_by_grid(solid, settings, 2, gpu::banded_sizes(count), many).packing,
                  expected);
    }
  }
}

TEST(BandedGrid, ArraysThatAreTooSmallGrow) {
  const MeshSolid solid(close_mesh(make_sample("bolt"), "bolt"));
  PackingSettings settings;
  settings.max_spheres = 500;
  const SpherePacking expected = pack(solid, settings);
  const GridOfTeams got = pack_by_grid(solid, settings, 2, {64, 64, 10, 1, 16, 64});
  EXPECT_GT(got.launches, 20);
  expect_same(got.packing, expected);
}

TEST(BandedGrid, StopsLikeTheCpu) {
  const MeshSolid solid(closed(icosphere_mesh(2), "icosphere"));
  std::vector<PackingSettings> cases(4);
  cases[0].max_spheres = 0;
  cases[0].target_coverage = 0.8;
  cases[1].max_spheres = 0;
  cases[1].min_radius = 0.05;
  cases[2].max_spheres = 200;
  cases[2].epsilon = 0.1;
  cases[3].max_spheres = 400;
  cases[3].seed = 7;
  for (const PackingSettings& settings : cases) {
    SCOPED_TRACE(&settings - cases.data());
    expect_same(pack_by_grid(solid, settings, 2, gpu::banded_sizes(1000)).packing,
                pack(solid, settings));
  }
}

}  // namespace
}  // namespace ist::testing
