// The batch functions of a GPU that ist::ist uses, on a device that is host memory.

#include <ist/gpu.h>
#include <ist/gpu_query.h>
#include <ist/gpu_scene.h>

#include <cstdlib>
#include <cstring>
#include <memory>
#include <utility>
#include <vector>

#include "emulated_device.h"
#include "query/base/members.h"
#include "support/host_batch.h"
#include "support/host_patches.h"
#include "support/host_scene.h"
#include "support/host_separations.h"

namespace ist {
namespace {

/// Whether an object that a batch needs is there when its work is done.
class Alive {
 public:
  Alive() = default;
  Alive(Alive&&) = default;
  ~Alive() {
    if (there_ != nullptr) *there_ = false;
  }

  std::shared_ptr<const bool> shown() const { return there_; }

 private:
  std::shared_ptr<bool> there_ = std::make_shared<bool>(true);
};

void need(const std::shared_ptr<const bool>& there) {
  if (!*there) std::abort();
}

std::vector<testing::BatchPair> rows_of(const GpuPairs& pairs) {
  std::vector<testing::BatchPair> rows(pairs.count);
  for (std::size_t i = 0; i < pairs.count; ++i) {
    testing::BatchPair& row = rows[i];
    row.a = pairs.a.solid[i];
    row.b = pairs.b.solid[i];
    if (pairs.a.pose != nullptr) row.pose_a = pairs.a.pose[i];
    if (pairs.b.pose != nullptr) row.pose_b = pairs.b.pose[i];
    if (pairs.a.scale != nullptr) row.scale_a = pairs.a.scale[i];
    if (pairs.b.scale != nullptr) row.scale_b = pairs.b.scale[i];
  }
  return rows;
}

/// Row i of a column, where it is wanted.
template <class Number, class Value>
void put(Number* column, std::size_t i, const Value& value) {
  if (column != nullptr)
    std::memcpy(column + i * (sizeof value / sizeof *column), &value, sizeof value);
}

/// Row i of the columns that an answer has members for.
template <class Answer, class Columns>
void write_row(const Answer& answer, const Columns& to, std::size_t i) {
  for_each_member([i](const auto& value, auto* column) { put(column, i, value); }, answer, to);
}

template <class Answer, class Columns>
void write(const std::vector<Answer>& found, const Columns& to) {
  for (std::size_t i = 0; i < found.size(); ++i) write_row(found[i], to, i);
}

}  // namespace

bool gpu_available(int device, std::string*) { return device >= 0 && device < 16; }
GpuInfo gpu_info(int) { return {"emulated", 90, 0, 0}; }

struct GpuSolids::Impl {
  std::vector<GpuSolid> given;
  testing::HostSolids solids;
  int device;
  Alive alive;
};

GpuSolids::GpuSolids(std::span<const GpuSolid> solids, const GpuSettings& settings)
    : impl_(new Impl{{solids.begin(), solids.end()},
                     std::vector<GpuSolid>(solids.begin(), solids.end()),
                     settings.device,
                     {}}) {}
std::size_t GpuSolids::size() const noexcept { return impl_->solids.refs().size(); }
std::size_t GpuSolids::bytes() const noexcept { return impl_->solids.bytes(); }
int GpuSolids::device() const noexcept { return impl_->device; }

struct GpuWorkspace::Impl {
  std::size_t most_pairs;
  int device;
  Alive alive;
};
GpuWorkspace::GpuWorkspace(std::size_t most_pairs, const GpuSettings& settings)
    : impl_(new Impl{most_pairs, settings.device, {}}) {}
std::size_t GpuWorkspace::most_pairs() const noexcept { return impl_->most_pairs; }

struct GpuKept::Impl {
  std::size_t most_pairs, bytes_each;
  Alive alive;
  mutable std::unique_ptr<testing::HostBatch> batch;  ///< made by the first launch
};
GpuKept::GpuKept(std::size_t most_pairs, std::size_t bytes_each, const GpuSettings&)
    : impl_(new Impl{most_pairs, bytes_each, {}, {}}) {}
std::size_t GpuKept::most_pairs() const noexcept { return impl_->most_pairs; }

namespace {

/// answer(solids, rows) → found, and write(found), when the stream comes to it.
template <class Answer, class Write>
void launch(const GpuSolids& solids, const GpuPairs& pairs, GpuWorkspace& workspace,
            CUstream_st* stream, const Answer& answer, const Write& write) {
  if (pairs.count > workspace.most_pairs()) std::abort();
  if (solids.device() != workspace.impl().device) std::abort();
  testing::do_later(
      stream, [&impl = solids.impl(), pairs, answer, write, there = solids.impl().alive.shown(),
               room = workspace.impl().alive.shown()] {
        need(there);
        need(room);
        write(answer(impl.solids, rows_of(pairs)));
      });
}

}  // namespace

void penetration_batch(const GpuSolids& solids, const GpuPairs& pairs,
                       const GpuPenetrationSettings& settings, GpuWorkspace& workspace,
                       const GpuPenetrations& to, CUstream_st* stream) {
  launch(
      solids, pairs, workspace, stream,
      [settings, most_pairs = workspace.most_pairs(),
       kept = settings.kept == nullptr ? Alive().shown() : settings.kept->impl().alive.shown()](
          const auto& there, const auto& rows) {
        if (settings.kept != nullptr) {
          need(kept);
          const GpuKept::Impl& keeps = settings.kept->impl();
          if (keeps.batch == nullptr) {
            keeps.batch = std::make_unique<testing::HostBatch>(there);
            keeps.batch->keep(static_cast<std::uint32_t>(keeps.most_pairs),
                              static_cast<std::uint32_t>(keeps.bytes_each));
          }
          return keeps.batch->run(rows, settings.measure);
        }
        testing::HostBatch batch(there);
        batch.cut_for(most_pairs);
        return batch.run(rows, settings.measure, 0, settings.pair_budget);
      },
      [to](const auto& found) { write(found, to); });
}

void separation_batch(const GpuSolids& solids, const GpuPairs& pairs,
                      const GpuSeparationSettings& settings, GpuWorkspace& workspace,
                      const GpuSeparations& to, CUstream_st* stream) {
  launch(
      solids, pairs, workspace, stream,
      [settings](const auto& there, const auto& rows) {
        return testing::HostSeparations(there).run(rows, 0, settings);
      },
      [to](const auto& found) { write(found, to); });
}

void contact_patches_batch(const GpuSolids& solids, const GpuPairs& pairs, Measure measure,
                           GpuWorkspace& workspace, const GpuPenetrations& whole,
                           const GpuContactPatches& to, CUstream_st* stream) {
  launch(
      solids, pairs, workspace, stream,
      [measure, most = to.most](const auto& there, const auto& rows) {
        return testing::HostPatches(there).run(rows, measure, most);
      },
      [whole, to](const std::vector<testing::PatchedPair>& found) {
        std::vector<Penetration> wholes;
        for (std::size_t i = 0; i < found.size(); ++i) {
          wholes.push_back(found[i].whole);
          put(to.count, i, static_cast<std::uint32_t>(found[i].patches.size()));
          for (std::size_t k = 0; k < found[i].patches.size(); ++k)
            write_row(found[i].patches[k], to, i * to.most + k);
        }
        write(wholes, whole);
      });
}

struct GpuScene::Impl {
  testing::HostScene scene;
  std::size_t bodies;
  GpuScenePairs pairs;
  Alive alive;
};
GpuScene::GpuScene(const GpuSolids& solids, std::span<const GpuSceneBody> bodies,
                   const GpuSceneSettings& settings, const GpuSettings&)
    : impl_(new Impl{
          testing::HostScene(solids.impl().given, bodies, settings), bodies.size(), {}, {}}) {
  impl_->pairs = impl_->scene.pairs();
}
std::size_t GpuScene::size() const noexcept { return impl_->bodies; }
std::size_t GpuScene::bytes() const noexcept { return 0; }
const GpuScenePairs& GpuScene::pairs() const noexcept { return impl_->pairs; }
void GpuScene::find_pairs(const Pose* poses, CUstream_st* stream) {
  testing::do_later(stream, [&impl = *impl_, poses, there = impl_->alive.shown()] {
    need(there);
    impl.scene.find_pairs(std::vector<Pose>(poses, poses + impl.bodies), 5);
  });
}

}  // namespace ist
