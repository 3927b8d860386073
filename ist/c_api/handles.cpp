#include "c_api/handles.h"

#include <ist/asset_layout.h>
#include <cstdio>

#include "c_api/structs.h"
#include "query/base/hooked_memory.h"

namespace ist::c_api {
namespace {

ist_status_t make_tree(const void* bytes, std::size_t size, ist_asset_t& asset) noexcept {
  AssetHandle& handle = *new (&asset) AssetHandle{};
  const AssetStatus status =
      AssetView::from_bytes({static_cast<const std::byte*>(bytes), size}, handle.view);
  if (status == AssetStatus::ok) handle.mark = handle.expected_mark();
  return status_of(status);
}

struct CloseFile {
  void operator()(std::FILE* file) const noexcept { std::fclose(file); }
};

/// Reads a whole file into memory from the hooks. Not a pipe or device: its size must be known.
ist_status_t read_file(const char* path, const MemoryHooks& hooks, HookedArray<std::byte>& out) {
  const std::unique_ptr<std::FILE, CloseFile> file(std::fopen(path, "rb"));
  // A folder can be opened, but not read, and its size is meaningless.
  if (!file || (std::fgetc(file.get()) == EOF && std::ferror(file.get()) != 0) ||
      std::fseek(file.get(), 0, SEEK_END) != 0)
    return IST_CANNOT_READ;
  const long size = std::ftell(file.get());
  if (size < 0 || std::fseek(file.get(), 0, SEEK_SET) != 0) return IST_CANNOT_READ;
  if (size == 0) return IST_TOO_SHORT;
  const auto bytes = static_cast<std::size_t>(size);
  out = {static_cast<std::byte*>(take_memory(hooks, bytes, kAssetAlignment)),
         {hooks, bytes, kAssetAlignment}};
  return std::fread(out.get(), 1, bytes, file.get()) == bytes ? IST_OK : IST_CANNOT_READ;
}

struct Sentence {
  ist_status_t status;
  const char* text;
};

constexpr Sentence kSentences[] = {
    {IST_OK, "done"},
    {IST_BUDGET_EXHAUSTED,
     "a limit or the workspace's capacity stopped the query before it finished; its bounds still "
     "hold"},
    {IST_ERROR_EXCEEDED,
     "finished, but the error is larger than relative_error: bake both assets with their meshes, "
     "or with more spheres"},
    {IST_INVALID_INPUT, "a pose, a scale, a number of a shape or a setting is out of range"},
    {IST_MISSING_DATA,
     "an asset lacks data that the query needs: the exact measure needs the kept meshes of two "
     "assets, every other query needs spheres (bake without mesh-only)"},
    {IST_NULL_POINTER, "a required pointer is null"},
    {IST_WRONG_SIZE,
     "this library does not know the size of a struct: set it to sizeof, and use headers and "
     "library of one version"},
    {IST_WRONG_VERSION,
     "this library does not support programs compiled with these headers; use headers and library "
     "of one version"},
    {IST_NO_HANDLE, "an asset, workspace or scene is empty, released or was never created"},
    {IST_NO_MEMORY, "out of memory"},
    {IST_CANNOT_READ, "the file cannot be read"},
    {IST_NO_DURATION, "ist_impact_settings_t::duration is 0; set the duration of the motion"},
    {IST_NOT_BAKED, "the mesh or a setting cannot be baked; the message of ist_bake() says why"},
    {IST_SCENE_FULL, "the scene is full: make it with a larger max_bodies"},
    {IST_NUMBER_TAKEN, "a body of this number is in the scene already"},
    {IST_NO_BODY, "no body of the scene has this number"},
};

}  // namespace

ist_status_t Allocator::from(const ist_allocator_t* given, Allocator& out) noexcept {
  if (given == nullptr) return IST_OK;
  if (given->size != sizeof *given) return IST_WRONG_SIZE;
  if (given->allocate == nullptr || given->release == nullptr) return IST_NULL_POINTER;
  out.hooks = {given->allocate, given->release, given->context};
  return IST_OK;
}

}  // namespace ist::c_api

using namespace ist;
using namespace ist::c_api;

ist_status_t ist_asset_view(const void* bytes, std::size_t size, ist_asset_t* asset) {
  if (asset == nullptr) return IST_NULL_POINTER;
  *asset = {};
  if (bytes == nullptr) return IST_NULL_POINTER;
  return make_tree(bytes, size, *asset);
}

ist_status_t ist_asset_load(const char* path, const ist_allocator_t* allocator,
                            ist_asset_t* asset) {
  if (asset == nullptr) return IST_NULL_POINTER;
  *asset = {};
  if (path == nullptr) return IST_NULL_POINTER;
  Allocator memory;
  ist_status_t status = Allocator::from(allocator, memory);
  if (status != IST_OK) return status;
  try {
    HookedArray<std::byte> bytes;
    status = read_file(path, memory.hooks, bytes);
    if (status != IST_OK) return status;
    const HookedRelease& owned = bytes.get_deleter();
    status = make_tree(bytes.get(), owned.bytes, *asset);
    if (status != IST_OK) return status;
    AssetHandle& handle = AssetHandle::in(*asset);
    handle.memory = memory.hooks;
    handle.size = owned.bytes;
    handle.bytes = bytes.release();
    return IST_OK;
  } catch (const std::bad_alloc&) {
    return IST_NO_MEMORY;
  }
}

ist_status_t ist_asset_release(ist_asset_t* asset) {
  if (asset == nullptr) return IST_NULL_POINTER;
  const AssetHandle handle = AssetHandle::in(*asset);
  if (!handle.made()) return IST_NO_HANDLE;
  *asset = {};
  if (handle.bytes != nullptr)
    give_memory_back(handle.memory, handle.bytes, handle.size, kAssetAlignment);
  return IST_OK;
}

ist_status_t ist_asset_get_info(const ist_asset_t* asset, ist_asset_info_t* info) {
  const ist_status_t size_status = clear(info);
  if (size_status != IST_OK) return size_status;
  AssetView view;
  const ist_status_t status = view_of(asset, view);
  if (status != IST_OK) return status;
  info->spheres = view.sphere_count();
  info->volume = view.volume();
  info->coverage = view.coverage();
  info->protrusion = view.protrusion();
  info->details = info->spheres == 0 ? 0 : view.header().detail_count + 1;
  static_assert(IST_MESH_UNRESOLVED == static_cast<int>(ist::MeshState::unresolved));
  info->mesh_triangles = view.mesh_triangles();
  info->mesh_state = static_cast<ist_mesh_state_t>(view.mesh_state());
  info->mesh_error = view.mesh_error();
  info->self_overlap_volume = view.self_overlap_volume();
  return IST_OK;
}

ist_status_t ist_asset_get_predicted_errors(const ist_asset_t* asset,
                                            ist_predicted_errors_t* errors) {
  static_assert(IST_TRIAL_PLATE == static_cast<int>(ist::TrialPartner::plate));
  const ist_status_t size_status = clear(errors);
  if (size_status != IST_OK) return size_status;
  AssetView view;
  const ist_status_t status = view_of(asset, view);
  if (status != IST_OK) return status;
  const ist::PredictedErrors found = view.predicted_errors();
  errors->poses = found.poses;
  static_assert(std::size(ist_predicted_errors_t{}.classes) == found.classes.size());
  for (std::size_t i = 0; i < found.classes.size(); ++i)
    errors->classes[i] = {found.classes[i].from, found.classes[i].to, found.classes[i].median};
  errors->target_error = found.target_error;
  errors->target_overlap = found.target_overlap;
  errors->measured_error = found.measured_error;
  errors->measured_poses = found.measured_poses;
  errors->worst_partner = static_cast<ist_trial_partner_t>(found.worst_partner);
  errors->target_met = found.target_met() ? 1 : 0;
  return IST_OK;
}

ist_status_t ist_workspace_make(std::size_t capacity, const ist_allocator_t* allocator,
                                ist_workspace_t* workspace) {
  if (workspace == nullptr) return IST_NULL_POINTER;
  *workspace = {};
  Allocator memory;
  const ist_status_t status = Allocator::from(allocator, memory);
  if (status != IST_OK) return status;
  constexpr std::size_t kDefault = 1u << 20;
  try {
    Workspace made(capacity == 0 ? kDefault : capacity, memory.hooks);
    new (workspace) WorkspaceHandle{WorkspaceHandle::kMark, std::move(made)};
    return IST_OK;
  } catch (const std::bad_alloc&) {
    return IST_NO_MEMORY;
  }
}

ist_status_t ist_deadline_make(double microseconds, ist_deadline_t* deadline) {
  if (deadline == nullptr) return IST_NULL_POINTER;
  *deadline = {};
  new (deadline) Deadline(microseconds);
  return IST_OK;
}

ist_status_t ist_deadline_limit(const ist_deadline_t* deadline,
                                ist_penetration_settings_t* settings) {
  if (deadline == nullptr || settings == nullptr) return IST_NULL_POINTER;
  PenetrationSettings limited;
  const ist_status_t status = ist::c_api::read(settings, limited);
  if (status != IST_OK) return status;
  deadline_in(*deadline).limit(limited);
  settings->pair_budget = limited.pair_budget;
  settings->spheres_only = limited.spheres_only ? 1 : 0;
  return IST_OK;
}

ist_status_t ist_deadline_record(ist_deadline_t* deadline, const ist_penetration_t* answer,
                                 double microseconds) {
  if (deadline == nullptr || answer == nullptr) return IST_NULL_POINTER;
  if (answer->size != sizeof *answer) return IST_WRONG_SIZE;
  deadline_in(*deadline).record(ist::c_api::read(*answer), microseconds);
  return IST_OK;
}

int32_t ist_deadline_too_slow(const ist_deadline_t* deadline) {
  return deadline != nullptr && deadline_in(*deadline).too_slow() ? 1 : 0;
}

ist_status_t ist_workspace_capacity(const ist_placed_t* a, const ist_placed_t* b,
                                    std::size_t* capacity) {
  if (capacity == nullptr) return IST_NULL_POINTER;
  *capacity = 0;
  ist::PlacedSolid first, second;
  ist_status_t status = read(a, first);
  if (status == IST_OK) status = read(b, second);
  if (status != IST_OK) return status;
  try {
    *capacity = ist::workspace_capacity(first, second);
    return IST_OK;
  } catch (const std::bad_alloc&) {
    return IST_NO_MEMORY;
  } catch (const ist::Error&) {
    return IST_INVALID_INPUT;
  }
}

ist_status_t ist_workspace_release(ist_workspace_t* workspace) {
  if (workspace == nullptr) return IST_NULL_POINTER;
  WorkspaceHandle& handle = WorkspaceHandle::in(*workspace);
  if (!handle.made()) return IST_NO_HANDLE;
  handle.~WorkspaceHandle();
  *workspace = {};
  return IST_OK;
}

const char* ist_describe(ist_status_t status) {
  for (const Sentence& one : kSentences)
    if (one.status == status) return one.text;
  if (status <= IST_TOO_SHORT && status >= IST_CORRUPT_LAYOUT)
    return describe(ist::c_api::asset_status_of(status));
  return "unknown status";
}

std::uint32_t ist_version() { return ist::version(); }

ist_status_t ist_check_version(std::uint32_t headers) {
  return ist::serves(headers) ? IST_OK : IST_WRONG_VERSION;
}
