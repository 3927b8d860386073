#pragma once

#include <algorithm>
#include <vector>

#include "cuda/packing/grids/device_rounds.h"
#include "packing/grids/pack_grids.h"

namespace ist::testing {

/// A round of a packing on grids, and the content of the grids at its end.
struct GridRound {
  double seconds = 0;  ///< since the start
  std::size_t spheres = 0;
  double coverage = 0;
  std::size_t prototypes = 0;    ///< placed in the round
  std::size_t cells = 0;         ///< of the distance grid
  std::size_t active_cells = 0;  ///< of these
  std::size_t bytes = 0;         ///< of both grids: words or hash table, records, lists, prototypes
  std::size_t dense_bytes = 0;   ///< of the same with a record and a prototype for every cell
  bool hashed = false;           ///< the distance grid stands in a hash table
};

/// The GPU's rounds, written down.
class RecordedRounds : public gpu::DeviceRounds {
 public:
  RecordedRounds(gpu::Queue& queue, const MeshSolid& solid, Stage& stage)
      : DeviceRounds(queue, solid.arrays()), volume_(solid.unit_volume()), stage_(stage) {}

  void append(const std::vector<Sphere>& spheres) {
    DeviceRounds::append(spheres);
    for (const Sphere& s : spheres) covered_ += packing::fixed_ball_volume(s.r, unit_);
    spheres_ += spheres.size();
    record(spheres_, std::min(1.0, static_cast<double>(covered_) * unit_ / volume_));
  }

  /// All rounds; of the last one only the packing tells.
  std::vector<GridRound> history(const SpherePacking& packing) {
    if (packing.spheres.size() > spheres_) record(packing.spheres.size(), packing.coverage);
    return std::move(history_);
  }

 private:
  void record(std::size_t spheres, double coverage) {
    constexpr std::size_t kPrototype = sizeof(std::uint32_t) + sizeof(packing::GridCandidate);
    constexpr std::size_t kCell = sizeof(packing::CellRecord) + sizeof(std::uint32_t);
    const std::size_t cells = grid_.layout().count(), lists = grid_.list_bytes();
    history_.push_back({stage_.elapsed(), spheres, coverage, count_, cells, grid_.active_cells(),
                        grid_.bytes() + count_ * kPrototype,
                        cells * kCell + prototypes_.count() * kPrototype + lists, grid_.hashed()});
  }

  const double volume_;
  const double unit_ = packing::volume_unit_of(volume_);
  Stage& stage_;
  std::uint64_t covered_ = 0;
  std::size_t spheres_ = 0;
  std::vector<GridRound> history_;
};

/// Packs on the GPU's grids and writes down every round.
inline std::vector<GridRound> history_on_grids(gpu::Queue& queue, const MeshSolid& solid,
                                               const PackingSettings& settings) {
  std::size_t free_bytes = 0, total_bytes = 0;
  gpu::check(cudaMemGetInfo(&free_bytes, &total_bytes), "querying the free memory");
  Stage stage("pack", {});
  RecordedRounds rounds(queue, solid, stage);
  const SpherePacking packing =
      packing::pack_grids_by(rounds, solid, settings, free_bytes / 2, stage);
  queue.wait();
  return rounds.history(packing);
}

}  // namespace ist::testing
