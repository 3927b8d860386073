#include <algorithm>
#include <cstddef>
#include <memory>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "cuda/query/batch_steps.h"
#include "cuda/query/detail_sums.h"
#include "cuda/query/exact_kept.h"
#include "cuda/query/exact_patches.h"
#include "cuda/query/field_steps.h"
#include "cuda/query/patch_steps.h"
#include "cuda/query/separation_steps.h"
#include "cuda/query/triangle_steps.h"
#include "support/host_batch.h"
#include "support/host_patches.h"
#include "support/host_separations.h"
#include "support/host_team.h"
#include "support/patch_columns.h"
#include "support/separation_columns.h"

namespace ist::testing {

std::vector<Penetration> HostBatch::run(const std::vector<BatchPair>& pairs, Measure measure,
                                        unsigned seed, std::uint32_t pair_budget) {
  const std::size_t n = pairs.size();
  const PairColumns columns(pairs);
  BatchColumns to = BatchColumns::unwritten(n);
  std::vector<std::uint32_t> list(gpu::kSizes * n), detailed(n);
  std::vector<gpu::SplitPair> splits(capacity_);
  std::vector<gpu::PairTask> tasks(capacity_);
  std::vector<std::uint32_t> posted(capacity_);
  std::vector<PairPlace> places(capacity_);
  std::vector<gpu::LensTotals> totals(2 * std::size_t{capacity_});
  std::vector<std::uint32_t> entries_a(capacity_), entries_b(capacity_);
  counters = {};
  const gpu::SolidPairs asked = solids_.asked(columns.pairs(), measure, to.answers());
  if (measure == Measure::exact) {
    run_exactly(asked, seed);
    return to.rows();
  }
  const gpu::BatchArrays batch = {asked,
                                  pair_budget,
                                  true,
                                  &counters,
                                  list.data(),
                                  detailed.data(),
                                  splits.data(),
                                  tasks.data(),
                                  posted.data(),
                                  places.data(),
                                  totals.data(),
                                  entries_a.data(),
                                  entries_b.data(),
                                  capacity_,
                                  capacity_,
                                  capacity_,
                                  most_alone,
                                  task_weight,
                                  by_size ? static_cast<std::uint32_t>(n) : 0};
  for (std::uint32_t i = 0; i < n; ++i) {
    std::uint32_t meet = 0;
    const gpu::PairUse use = gpu::sift_pair(batch, i, meet);
    if (use == gpu::PairUse::summed) gpu::list_pair(batch, i, meet, counters.listed++);
    if (use == gpu::PairUse::detailed) detailed[counters.detailed++] = i;
  }
  const auto details = std::make_unique<gpu::DetailMemory>();
  for (std::uint32_t k = 0; k < counters.detailed; ++k)
    by_team(seed, [&](const auto& team) { gpu::sum_details(team, batch, detailed[k], *details); });
  sum(batch, seed);
  for (const std::uint32_t flag : posted)
    if (flag != 0) throw std::logic_error("a task was not taken");
  run_fields(asked, seed);
  return to.rows();
}

void HostBatch::keep(std::uint32_t most_pairs, std::uint32_t bytes_each) {
  kept_memory_.assign(most_pairs * std::size_t{bytes_each} / 8, 0);
  kept_ = {reinterpret_cast<std::byte*>(kept_memory_.data()), most_pairs, bytes_each, nullptr,
           nullptr};
}

/// The kernels of exact_kernels.cu.
void HostBatch::run_exactly(const gpu::SolidPairs& asked, unsigned seed) {
  gpu::ExactArrays batch = {};
  static_cast<gpu::SolidPairs&>(batch) = asked;
  exact_counters = {};
  batch.counters = &exact_counters;
  std::vector<std::uint32_t> lists[gpu::kExactPasses], next(mesh_chunks);
  std::vector<gpu::ExactQuery> mesh_queries(mesh_capacity);
  std::vector<gpu::ExactChunk> chunks(mesh_chunks);
  for (int k = 0; k < gpu::kExactPasses; ++k) {
    lists[k].resize(asked.pairs.count);
    batch.list[k] = lists[k].data();
  }
  batch.queries = mesh_queries.data();
  batch.query_capacity = mesh_capacity;
  batch.pool = {chunks.data(), next.data(), nullptr, mesh_chunks};
  for (const gpu::SolidRef& solid : solids_.refs())
    batch.most_blocks = std::max(batch.most_blocks, solid.mesh.count);
  gpu::ExactKept kept = kept_;
  gpu::KeptRound kept_rounds[2] = {};
  std::vector<std::uint32_t> kept_list(mesh_capacity);
  kept.rounds = kept_rounds;
  kept.list = kept_list.data();
  if (kept.pairs > 0 && kept.pairs < asked.pairs.count) throw std::logic_error("too few are kept");
  held = fresh = 0;
  for (std::uint32_t i = 0; i < asked.pairs.count; ++i) {
    if (!(kept.pairs > 0 ? gpu::sift_kept(batch, kept, i) : gpu::sift_exact(batch, i))) continue;
    lists[0][exact_counters.listed[0]++] = i;
    if (kept.pairs > 0 && kept.head(i).state == gpu::KeptState::holds) ++held;
  }
  std::vector<std::uint64_t> bytes;
  const auto workspace = [&](int pass) {
    bytes.assign(batch.bytes_of_team(pass) / 8, ~std::uint64_t{0});
    batch.team_memory = batch.memory = reinterpret_cast<std::byte*>(bytes.data());
    const gpu::ExactWorkspace of_pass = batch.workspace(pass, 0);
    gpu::clear_marks(SerialTeam(), of_pass);
    return of_pass;
  };
  const auto pair = std::make_unique<gpu::ExactPair>();
  const auto ahead = std::make_unique<gpu::ExactAheadPair>();
  const auto search = std::make_unique<gpu::ExactSearchMemory>();
  const auto sum = std::make_unique<gpu::ExactSumMemory>();
  const auto contact = std::make_unique<gpu::ExactContactMemory>();
  const auto whole = std::make_unique<gpu::ExactWholeMemory>();
  const gpu::ExactWorkspace first_work = workspace(0);
  std::uint32_t n = 0;
  for (std::uint32_t first = 0; n < std::min(most_rounds, 100u) && first < exact_counters.listed[0];
       ++n) {
    gpu::ExactRound& round = gpu::round_of(batch, n);
    const std::uint32_t count = gpu::pairs_from(batch, first);
    round = {first, count, 0, 0, 0, 0, 0, 0, 0, 0};
    kept.round(n + 1) = {};
    for (std::uint32_t k = 0; k < count; ++k) {
      gpu::place_query(batch, k, first + k);
      if (kept.pairs > 0) gpu::list_fresh(batch, kept, n, k);
    }
    for (std::uint32_t k = 0; k < kept.round(n).fresh; ++k)
      by_team(seed, [&](const auto& team) {
        gpu::keep_query(team, batch, kept, kept.list[k], *ahead, *search);
        if (team.lane() == 0)
          fresh += kept.head(batch.queries[kept.list[k]].pair).state == gpu::KeptState::holds;
      });
    for (; round.searched < count && gpu::goes_on(batch, n, 0); ++round.searched)
      by_team(seed, [&](const auto& team) {
        if (kept.pairs > 0)
          gpu::search_kept_query(team, batch, kept, round, round.searched, *pair, *search);
        else
          gpu::search_query(team, batch, round, round.searched, *pair, *search);
      });
    const auto sum_all = [&]<bool kExactly>(std::uint32_t all) {
      for (std::uint32_t k = 0; k < all; ++k)
        by_team(seed, [&](const auto& team) {
          gpu::sum_query<kExactly>(team, batch, round, k, first_work, *pair, *sum);
        });
    };
    sum_all.template operator()<false>(round.searched);
    sum_all.template operator()<true>(round.unsure);
    exact_counters.exactly += round.unsure;
    for (std::uint32_t k = 0; k < round.nothing; ++k)
      by_team(seed, [&](const auto& team) { gpu::touch_query(team, batch, k, *pair, *contact); });
    if (round.searched == 0) throw std::logic_error("a round has no memory for a pair");
    first = gpu::end_of(round);
  }
  rounds = n;
  for (int pass = 1; pass < gpu::kExactPasses; ++pass) {
    const gpu::ExactWorkspace of_pass = workspace(pass);
    const std::uint32_t listed = exact_counters.listed[pass];
    for (std::uint32_t k = 0; k < gpu::pairs_of_pass(batch, pass, n); ++k)
      by_team(seed, [&](const auto& team) {
        gpu::ask_pass(team, batch, pass, n, listed, k, of_pass, *whole);
      });
  }
}

void HostBatch::cut_for(std::size_t most_pairs) {
  gpu::BatchArrays arrays;
  arrays.cut_for(most_pairs);
  most_alone = arrays.most_alone;
  task_weight = arrays.task_weight;
  by_size = arrays.size_capacity > 0;
}

void HostBatch::sum(const gpu::BatchArrays& batch, unsigned seed) {
  const auto memory = std::make_unique<gpu::WorkMemory>();
  memory->is_task = false;
  constexpr std::uint32_t kMost = 1 + gpu::kPlacedAhead;
  for (std::uint32_t k = 0; k < counters.listed; k += kMost)
    by_team(seed, [&](const auto& team) {
      gpu::place_pairs(team, batch, k, std::min(kMost, counters.listed - k), *memory);
      for (;;) {
        if (team.lane() == 0) memory->hand_out = memory->at % 4 != 0;
        gpu::do_work(team, batch, *memory);
        if (memory->waiting == 0) return;
        team.sync();
        gpu::take_placed(team, *memory);
      }
    });
  memory->is_task = true;
  for (std::uint32_t k = 0; gpu::look_for_task(batch, k, 0) != 0; ++k) {
    memory->at = k;
    by_team(seed, [&](const auto& team) {
      if (gpu::take_task(team, batch, *memory)) gpu::do_work(team, batch, *memory);
    });
  }
}

void HostBatch::run_fields(const gpu::SolidPairs& asked, unsigned seed) {
  const std::size_t n = asked.pairs.count;
  std::vector<std::uint32_t> lists[2] = {std::vector<std::uint32_t>(n),
                                         std::vector<std::uint32_t>(n)};
  field_counters = {};
  rounds = 0;
  const gpu::FieldBatch batch = {
      asked, &field_counters, {lists[0].data(), lists[1].data()}, triangle_work()};
  for (std::uint32_t i = 0; i < n; ++i) {
    const int group = gpu::sift_field_pair(batch, i);
    if (group >= 0) gpu::listed_pair(batch, group, field_counters.listed[group]++) = i;
  }
  const auto memory = std::make_unique<gpu::WalkMemory>();
  for (std::uint32_t k = 0; k < field_counters.listed[gpu::kSmooth]; ++k)
    by_team(seed, [&](const auto& team) {
      gpu::sum_field_pair(team, batch, gpu::listed_pair(batch, gpu::kSmooth, k), *memory);
    });
  sum_rounds(batch, seed);
}

gpu::TriangleWorkspace HostBatch::triangle_work() {
  queries_.resize(query_capacity);
  parts_.resize(part_capacity);
  words_.resize(word_capacity);
  return {queries_.data(), parts_.data(), words_.data(),
          query_capacity,  part_capacity, word_capacity};
}

void HostBatch::sum_rounds(const gpu::FieldBatch& batch, unsigned seed) {
  const auto walks = std::make_unique<gpu::FacetWalkMemory>();
  const auto sums = std::make_unique<gpu::FacetSumMemory>();
  const auto whole = std::make_unique<gpu::FacetWholeMemory>();
  const std::uint32_t listed = field_counters.listed[gpu::kFacets];
  std::uint32_t first = 0;
  for (std::uint32_t n = 0; n < most_rounds && first < listed; ++n, ++rounds) {
    gpu::TriangleRound& round = gpu::round_of(batch, n);
    round = {first, 0, 0, 0, 0};
    const std::uint32_t count = gpu::pairs_from(batch, first);
    for (std::uint32_t k = 0; k < count; ++k) gpu::place_query(batch, k, first + k);
    for (; round.walked < count && gpu::goes_on(batch, round, 1); ++round.walked)
      by_team(seed,
              [&](const auto& team) { gpu::walk_query(team, batch, round, round.walked, *walks); });
    for (std::uint32_t k = 0; k < std::min(round.parts, part_capacity); ++k)
      by_team(seed, [&](const auto& team) { gpu::sum_part(team, batch, k, *sums); });
    for (std::uint32_t k = 0; k < round.walked; ++k) gpu::answer_query(batch, k);
    if (round.walked == 0) throw std::logic_error("a round has no memory for a pair");
    first = gpu::end_of(batch, round);
  }
  const std::uint32_t large = field_counters.large;
  for (std::uint32_t k = 0; k < large + (listed - first); ++k) {
    const std::uint32_t at = k < large ? k : first + (k - large);
    by_team(seed, [&](const auto& team) {
      gpu::sum_whole_query(team, batch, gpu::listed_pair(batch, gpu::kFacets, at), *whole);
    });
  }
}

std::vector<PatchedPair> HostPatches::run(const std::vector<BatchPair>& pairs, Measure measure,
                                          std::uint32_t most, unsigned seed) {
  const std::size_t n = pairs.size();
  const PairColumns columns(pairs);
  BatchColumns wholes = BatchColumns::unwritten(n);
  constexpr double kUnwritten = -7;
  const std::vector<double> numbers(n * most, kUnwritten), vectors(3 * n * most, kUnwritten);
  PatchColumns to{most,
                  std::vector<std::uint32_t>(n, 99),
                  std::vector<std::uint64_t>(n * most),
                  vectors,
                  vectors,
                  numbers,
                  numbers,
                  numbers,
                  vectors,
                  vectors,
                  vectors,
                  numbers};
  // The memory's content from earlier teams must not matter.
  std::vector<std::byte> memory_of_team(gpu::PatchWorkspace::bytes(solids_.most_bins()),
                                        std::byte{0xA5});
  gpu::PatchArrays batch = {};
  static_cast<gpu::SolidPairs&>(batch.pairs) =
      solids_.asked(columns.pairs(), measure, wholes.answers());
  batch.patches = {most,
                   to.count.data(),
                   to.id.data(),
                   to.centroid.data(),
                   to.normal.data(),
                   to.area.data(),
                   to.depth.data(),
                   to.volume.data(),
                   to.force.data(),
                   to.torque.data(),
                   to.point.data(),
                   to.torsion.data()};
  batch.team_memory = memory_of_team.data();
  batch.most_bins = solids_.most_bins();
  if (measure == Measure::exact) {
    divide_exactly(batch.pairs, batch.patches, seed);
    return to.rows(wholes.rows());
  }
  const auto memory = std::make_unique<gpu::PatchMemory>();
  for (std::uint32_t i = 0; i < n; ++i)
    if (gpu::sift_patches(batch, i))
      by_team(seed, [&](const auto& team) {
        gpu::patch_pair(team, batch, i, batch.workspace(0), *memory);
      });
  return to.rows(wholes.rows());
}

/// The kernels of exact_patch_kernels.cu.
void HostPatches::divide_exactly(const gpu::SolidPairs& asked, const GpuContactPatches& patches,
                                 unsigned seed) {
  gpu::ExactPatchArrays batch = {};
  static_cast<gpu::SolidPairs&>(batch) = asked;
  batch.patches = patches;
  exact_counters = {};
  batch.counters = &exact_counters;
  std::vector<std::uint32_t> lists[gpu::kExactPasses];
  for (int k = 0; k < gpu::kExactPasses; ++k) {
    lists[k].resize(asked.pairs.count);
    batch.list[k] = lists[k].data();
  }
  for (const gpu::SolidRef& solid : solids_.refs())
    batch.most_blocks = std::max(batch.most_blocks, solid.mesh.count);
  for (std::uint32_t i = 0; i < asked.pairs.count; ++i)
    if (gpu::sift_exact_patches(batch, i))
      lists[gpu::kFirstPatchPass][exact_counters.listed[gpu::kFirstPatchPass]++] = i;
  const auto memory = std::make_unique<gpu::ExactWholeMemory>();
  for (int pass = gpu::kFirstPatchPass; pass < gpu::kExactPasses; ++pass) {
    // The contents of fresh memory must not matter.
    std::vector<std::uint64_t> bytes(batch.bytes_of_team(pass) / 8, 0xA5A5A5A5A5A5A5A5u);
    batch.memory = reinterpret_cast<std::byte*>(bytes.data());
    const gpu::ExactWorkspace work = batch.workspace(pass, 0);
    gpu::Arena parts = batch.arena(pass, 0);
    parts.end = parts.at + std::min(parts.end - parts.at, part_bytes[pass]);
    gpu::clear_marks(SerialTeam(), work);
    for (std::uint32_t k = 0; k < exact_counters.listed[pass]; ++k)
      by_team(seed, [&](const auto& team) {
        gpu::patch_pass(team, batch, pass, k, work, parts, *memory);
      });
  }
}

std::vector<Separation> HostSeparations::run(const std::vector<BatchPair>& pairs, unsigned seed,
                                             const GpuSeparationSettings& settings) {
  const std::size_t n = pairs.size();
  const PairColumns columns(pairs);
  constexpr double kUnwritten = -7;
  const std::vector<double> numbers(n, kUnwritten), vectors(3 * n, kUnwritten);
  SeparationColumns to{numbers,
                       numbers,
                       numbers,
                       vectors,
                       vectors,
                       vectors,
                       std::vector<QueryStatus>(n),
                       std::vector<std::uint32_t>(n),
                       std::vector<std::uint32_t>(n)};
  const std::vector<std::uint32_t> list(n);
  std::vector<std::uint32_t> lists[3] = {list, list, list};
  std::vector<gpu::SplitPair> splits(capacity_);
  std::vector<gpu::PairTask> tasks(capacity_);
  std::vector<gpu::GapTotals> totals(2 * std::size_t{capacity_});
  std::vector<std::uint32_t> entries_a(capacity_), entries_b(capacity_);
  std::vector<double> entries_gap(capacity_), entries_cover(capacity_);
  counters[0] = counters[1] = counters[2] = {};
  gpu::SeparationArrays batch = {};
  static_cast<gpu::SolidPairs&>(batch.pairs) = solids_.asked(columns.pairs(), Measure::inner, {});
  batch.counters = counters;
  for (int kind = 0; kind < 3; ++kind) batch.list[kind] = lists[kind].data();
  batch.pairs.splits = splits.data();
  batch.pairs.tasks = tasks.data();
  batch.pairs.split_capacity = batch.pairs.task_capacity = batch.pairs.entry_capacity = capacity_;
  batch.answers = {to.distance.data(), to.distance_min.data(), to.distance_max.data(),
                   to.point_a.data(),  to.point_b.data(),      to.normal.data(),
                   to.status.data(),   to.visits.data(),       to.spheres.data()};
  batch.max_visits = settings.max_visits == 0 ? ~0u : settings.max_visits;
  batch.max_distance = settings.max_distance;
  batch.totals = totals.data();
  batch.entries = {entries_a.data(), entries_b.data(), entries_gap.data(), entries_cover.data()};
  for (std::uint32_t i = 0; i < n; ++i) {
    const int list = gpu::sift_separation(batch, i);
    if (list >= 0) lists[list][counters[list].listed++] = i;
  }
  separate<float>(batch, 0, seed);
  separate<double>(batch, 1, seed);
  separate_meshes(batch, seed);
  return to.rows();
}

/// The kernels of meshes in separation_kernels.cu.
void HostSeparations::separate_meshes(gpu::SeparationArrays& batch, unsigned seed) {
  gpu::MeshGapRound rounds[2] = {};
  std::vector<gpu::MeshGapQuery> queries(mesh_capacity);
  batch.meshes = {rounds, queries.data(), mesh_capacity};
  const auto spheres = std::make_unique<gpu::GapMemory<float>>();
  const auto single = std::make_unique<gpu::MeshGapMemory<float>>();
  const auto in_double = std::make_unique<gpu::MeshGapMemory<double>>();
  const auto pair = std::make_unique<gpu::MeshGapPair>();
  const auto stack = std::make_unique<InsideStack>();
  const std::uint32_t listed = counters[2].listed;
  for (std::uint32_t n = 0; n * mesh_capacity < listed; ++n) {
    const std::uint32_t first = n * mesh_capacity, count = std::min(mesh_capacity, listed - first);
    gpu::MeshGapRound& round = gpu::round_of(batch.meshes, n);
    round = {};
    for (std::uint32_t k = 0; k < count; ++k)
      gpu::place_mesh_gap(batch, round, k, batch.list[2][first + k]);
    for (std::uint32_t k = 0; k < count; ++k)
      by_team(seed, [&](const auto& team) { gpu::glance_at_spheres(team, batch, k, *spheres); });
    for (std::uint32_t k = 0; k < count; ++k)
      by_team(seed,
              [&](const auto& team) { gpu::search_mesh_gap<float>(team, batch, k, *single); });
    for (std::uint32_t k = 0; k < round.in_double; ++k)
      by_team(seed, [&](const auto& team) {
        gpu::search_mesh_gap<double>(team, batch, queries[k].in_double, *in_double);
      });
    for (std::uint32_t k = 0; k < count; ++k)
      by_team(seed, [&](const auto& team) { gpu::measure_mesh_gap(team, batch, k, *pair); });
    for (std::uint32_t k = 0; k < count; ++k)
      by_team(seed, [&](const auto& team) { gpu::finish_mesh_gap(team, batch, k, *stack); });
  }
}

template <class Real>
void HostSeparations::separate(const gpu::SeparationArrays& batch, int kind, unsigned seed) {
  const auto memory = std::make_unique<gpu::GapMemory<Real>>();
  for (std::uint32_t k = 0; k < counters[kind].listed; ++k)
    by_team(seed, [&](const auto& team) {
      gpu::separate_pair<std::decay_t<decltype(team)>, Real>(team, batch, batch.list[kind][k],
                                                             *memory);
    });
  for (std::uint32_t k = 0; k < std::min(counters[kind].tasks, capacity_); ++k)
    by_team(seed, [&](const auto& team) {
      gpu::separate_task<std::decay_t<decltype(team)>, Real>(team, batch, k, *memory);
    });
}

}  // namespace ist::testing
