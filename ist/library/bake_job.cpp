#include "library/bake_job.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <optional>
#include <system_error>
#include <utility>

#include <ist/asset_layout.h>
#include <ist/error.h>

#include "bake/asset/atomic_file.h"
#include "library/input_mesh.h"
#include "robot/link_mesh.h"

namespace ist {
namespace {

namespace fs = std::filesystem;

/// Nothing is written where the very bytes stand already.
void write_asset(const fs::path& path, const Asset& asset) {
  std::error_code none;
  if (fs::file_size(path, none) == asset.bytes().size() && !none) {
    std::ifstream file(path, std::ios::binary);
    std::vector<char> there(asset.bytes().size());
    const auto* const bytes = reinterpret_cast<const char*>(asset.bytes().data());
    if (file.read(there.data(), static_cast<std::streamsize>(there.size())) &&
        std::equal(there.begin(), there.end(), bytes))
      return;
  }
  asset.save(path);
}

/// Another run, on a machine with more time, would give another asset.
bool was_out_of_time(const TreeView& tree) {
  const AssetHeader& h = tree.header();
  const auto late = static_cast<std::uint32_t>(StopReason::time_limit);
  return h.stop_reason == late || (h.asked_error > 0 && h.search_stop == late);
}

void describe(const CacheEntry& entry, const RunSettings& settings, JobResult& result) {
  const TreeView& tree = entry.asset.view();
  result.content_hash = tree.header().content_hash;
  result.bytes = entry.asset.bytes().size();
  result.spheres = tree.sphere_count();
  result.coverage = tree.coverage();
  result.volume = tree.volume();
  result.protrusion = tree.protrusion();
  result.surface_error = tree.field_error();
  result.has_surface = tree.has_field();
  result.mesh_state = name_of(tree.mesh_state());
  result.mesh_triangles = tree.mesh_triangles();
  result.mesh_error = tree.mesh_error();
  result.counted_twice = tree.counted_twice();
  if (const PredictedErrors errors = tree.predicted_errors(); errors.target_error > 0) {
    result.target_error = errors.target_error;
    result.target_met = errors.target_met();
    if (errors.measured_poses > 0) result.error = errors.measured_error;
  }
  result.confidence = entry.confidence;
  for (std::string& warning : settings.warnings_of(tree))
    result.warnings.push_back(std::move(warning));
  result.warnings.insert(result.warnings.end(), entry.notes.begin(), entry.notes.end());
}

CacheEntry bake_entry(const Job& job, const BakeMesh& bake) {
  InputMesh mesh;
  try {
    if (job.shape)
      mesh.closed = close_as_asked(mesh_of(*job.shape, {job.urdf, {}, ""}, job.urdf).mesh, job.mesh,
                                   job.settings.mesh);
    else
      mesh = read_input_mesh(job.mesh, job.settings.mesh);
  } catch (const OpenMeshError& error) {
    throw Error(std::string(error.what()) + (job.settings.mesh.repair
                                                 ? "; wrap = '0.5%' encloses it in a closed surface"
                                                 : "; repair = true tries to close it"));
  }
  CacheEntry entry = {bake(mesh.closed, job.settings), std::move(mesh.closed.report.notes)};
  if (const auto& judged = mesh.closed.report.judged) entry.confidence = judged->confidence;
  return entry;
}

/// Throws Error where an asset is not what its manifest demands.
void check_demands(const Job& job, const CacheEntry& entry) {
  const TreeView& tree = entry.asset.view();
  const Demands& demands = job.demands;
  const bool lacks_field = !tree.has_field() && tree.sphere_count() > 0;
  if (demands.surface &&
      (lacks_field || tree.mesh_triangles() == 0 || tree.mesh_state() == MeshState::unresolved))
    throw Error(
        fmt::format("{}: require-surface: the asset holds no surface to query; its mesh is "
                    "'{}'. Repair the mesh, and keep it with surface = \"all\"",
                    job.mesh, name_of(tree.mesh_state())));
  if (!(tree.coverage() >= demands.coverage))
    throw Error(
        fmt::format("{}: min-coverage: spheres fill {:.1f} % of the volume, less than "
                    "{:.1f} %. Allow more spheres",
                    job.mesh, 100 * tree.coverage(), 100 * demands.coverage));
  if (entry.confidence && !(*entry.confidence >= demands.confidence))
    throw Error(
        fmt::format("{}: min-confidence: the closed mesh has a confidence of {:.2f}, less "
                    "than {:.2f}. Repair the mesh by hand",
                    job.mesh, *entry.confidence, demands.confidence));
}

}  // namespace

JobResult do_job(const Job& job, const RunSettings& settings, const BakeMesh& bake) {
  JobResult result;
  result.name = job.name;
  result.mesh = job.mesh;
  result.status = JobStatus::baked;

  std::optional<CacheEntry> entry;
  std::optional<CacheKey> key;
  if (settings.cache || settings.record) key = cache_key(job);
  if (settings.record) entry = settings.record->find(job.name, *key);
  if (settings.cache) {
    std::string damage;
    entry = settings.cache->find(*key, damage);
    if (!damage.empty())
      result.warnings.push_back("the cache entry is damaged, so the asset was baked again: " +
                                damage);
  }
  if (entry) result.status = JobStatus::cached;
  const bool baked = !entry;
  if (baked) {
    entry = bake_entry(job, bake);
    if (key && cache_key(job) != *key)
      throw Error(job.mesh + ": the file changed during the bake. Bake it again");
  }
  const bool lasts = baked && !was_out_of_time(entry->asset.view());
  try {
    if (settings.cache && lasts) settings.cache->store(*key, *entry);
  } catch (const Error& error) {
    result.warnings.push_back(std::string("not stored in the cache: ") + error.what());
  }
  check_demands(job, *entry);
  const fs::path path = settings.output / (job.name + ".ist");
  write_asset(path, entry->asset);
  if (settings.record && lasts) settings.record->add(job.name, *key, *entry);
  result.asset = path.string();
  describe(*entry, settings, result);
  return result;
}

}  // namespace ist
