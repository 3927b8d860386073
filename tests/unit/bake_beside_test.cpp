// Bakes whose backend does two things at a time, as a GPU's does, by a stand-in on the host.

#include <gtest/gtest.h>
#include <ist/bake.h>
#include <ist/types.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <thread>

#include "bake/bake_solid.h"
#include "base/thread_arena.h"
#include "support/on_host.h"
#include "support/test_meshes.h"

namespace ist {
namespace {

/// The calls that a bake's stand-ins received.
struct Seen {
  std::atomic<int> beside = 0;
  std::atomic<bool> levels_fail = false;
  std::atomic<bool> levels_wait = false;  ///< the second one's, until they are cancelled
  std::atomic<bool> waited_in_vain = false;
  std::atomic<int> relaxed = 0;  ///< levels, by the second one
  std::thread::id relaxed_by;
};

/// A host backend that pretends to leave the host's threads idle.
class TwoAtATime final : public SolidBackend {
 public:
  TwoAtATime(const MeshSolid& solid, Seen& seen, bool is_second = false)
      : solid_(solid), seen_(seen), is_second_(is_second), host_(testing::host_backend(solid)) {}

  SpherePacking pack(const PackingSettings& settings, const ProgressCallback& progress) override {
    return host_->pack(settings, progress);
  }
  std::vector<MedialNode> medial_nodes(const MedialSettings& settings) override {
    return host_->medial_nodes(settings);
  }
  RelaxedSites relax_sites(const RelaxTask& task,
                           const std::function<void(double)>& report) override {
    if (is_second_) {
      if (seen_.levels_fail) throw Error("no memory for levels");
      ++seen_.relaxed;
      seen_.relaxed_by = std::this_thread::get_id();
      const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
      while (seen_.levels_wait && std::chrono::steady_clock::now() < end) report(0.5);
      if (seen_.levels_wait) seen_.waited_in_vain = true;
    }
    return host_->relax_sites(task, report);
  }
  double largest_protrusion(std::span<const Sphere> balls) override {
    return host_->largest_protrusion(balls);
  }
  std::vector<double> cover_radii(const CoverTask& task,
                                  const std::function<void(int)>& report) override {
    return host_->cover_radii(task, report);
  }
  std::unique_ptr<SolidBackend> with(const MeshSolid& other) const override {
    return host_->with(other);
  }
  std::function<std::unique_ptr<SolidBackend>()> beside() override {
    return [this] {
      ++seen_.beside;
      return std::make_unique<TwoAtATime>(solid_, seen_, true);
    };
  }
  bool leaves_threads_idle() const override { return true; }

 private:
  const MeshSolid& solid_;
  Seen& seen_;
  const bool is_second_;
  const std::unique_ptr<SolidBackend> host_;
};

ClosedMesh torus() { return testing::closed(testing::torus_mesh(1.0, 0.4, 40, 20), "torus"); }

PackingSettings of_size(std::size_t spheres, unsigned threads) {
  PackingSettings settings;
  settings.max_spheres = spheres;
  settings.threads = threads;
  settings.device = Device::cpu;
  return settings;
}

Asset baked_beside(const ClosedMesh& mesh, const PackingSettings& settings, Seen& seen,
                   const ProgressCallback& progress = {}) {
  return thread_arena(settings.threads).execute([&] {
    const Resolution as_it_is;
    const MeshSolid solid(ResolvedMesh{mesh, as_it_is});
    SharedMesh kept(solid, as_it_is, settings.keep_mesh, settings.threads);
    TwoAtATime backend(solid, seen);
    return bake_solid(mesh, solid, kept, backend, settings, progress);
  });
}

TEST(BakeBeside, MakesTheSameAsset) {
  const ClosedMesh mesh = torus();
  for (const std::size_t spheres : {1u, 1200u})  // no and one level of detail
    for (const unsigned threads : {1u, 2u, 0u}) {
      Seen seen;
      const Asset alone = bake(mesh, of_size(spheres, threads));
      const Asset beside = baked_beside(mesh, of_size(spheres, threads), seen);
      EXPECT_TRUE(std::ranges::equal(alone.bytes(), beside.bytes()))
          << spheres << " spheres, " << threads << " threads";
      EXPECT_EQ(seen.beside, spheres > 1000 ? 1 : 0);
      EXPECT_EQ(seen.relaxed, seen.beside);
      EXPECT_NE(seen.relaxed_by, std::this_thread::get_id());
    }
}

TEST(BakeBeside, CancellingEndsBoth) {
  const std::thread::id caller = std::this_thread::get_id();
  for (const std::string stage : {"calibrate", "cover", "tree"}) {
    Seen seen;
    seen.levels_wait = stage != "tree";
    const auto until_then = [&](const Progress& now) {
      EXPECT_EQ(std::this_thread::get_id(), caller);
      return now.stage != stage;
    };
    EXPECT_THROW(baked_beside(torus(), of_size(1200, 2), seen, until_then), Error) << stage;
    EXPECT_EQ(seen.beside, 1) << stage;
    EXPECT_FALSE(seen.waited_in_vain) << stage;
  }
}

TEST(BakeBeside, AnErrorThereReachesTheCaller) {
  Seen seen;
  seen.levels_fail = true;
  try {
    baked_beside(torus(), of_size(1200, 0), seen);
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "no memory for levels");
  }
}

}  // namespace
}  // namespace ist
