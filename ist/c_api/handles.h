#pragma once

#include <ist/c.h>
#include <ist/deadline.h>
#include <ist/query.h>
#include <cstring>

namespace ist::c_api {

/// The allocator of a C caller; null uses the heap.
struct Allocator {
  MemoryHooks hooks;

  static ist_status_t from(const ist_allocator_t* given, Allocator& out) noexcept;
};

/// A tree's handle. The mark identifies invalid handles without following a pointer.
struct AssetHandle {
  std::uint64_t mark;
  AssetView view;
  void* bytes;  ///< owned, or null
  std::size_t size;
  MemoryHooks memory;

  static constexpr std::uint64_t kMark = 0x7473692d65657274;  // "tree-ist"

  static AssetHandle& in(ist_asset_t& tree) noexcept {
    return *reinterpret_cast<AssetHandle*>(&tree);
  }
  static const AssetHandle& in(const ist_asset_t& tree) noexcept {
    return *reinterpret_cast<const AssetHandle*>(&tree);
  }
  std::uint64_t expected_mark() const noexcept {
    std::uintptr_t address;
    std::memcpy(&address, &view, sizeof address);
    return kMark ^ address;
  }
  bool made() const noexcept { return mark == expected_mark(); }
};
static_assert(sizeof(AssetHandle) <= sizeof(ist_asset_t) && sizeof(AssetView) == sizeof(void*));

struct WorkspaceHandle {
  std::uint64_t mark;
  Workspace workspace;

  static constexpr std::uint64_t kMark = 0x7473692d6b726f77;  // "work-ist"

  static WorkspaceHandle& in(ist_workspace_t& workspace) noexcept {
    return *reinterpret_cast<WorkspaceHandle*>(&workspace);
  }
  bool made() const noexcept { return mark == kMark; }
};
static_assert(sizeof(WorkspaceHandle) <= sizeof(ist_workspace_t));

/// A deadline has no handle: all zero means no limit.
static_assert(sizeof(Deadline) <= sizeof(ist_deadline_t));
inline Deadline& deadline_in(ist_deadline_t& deadline) noexcept {
  return *reinterpret_cast<Deadline*>(&deadline);
}
inline const Deadline& deadline_in(const ist_deadline_t& deadline) noexcept {
  return *reinterpret_cast<const Deadline*>(&deadline);
}

inline ist_status_t view_of(const ist_asset_t* tree, AssetView& view) noexcept {
  if (tree == nullptr) return IST_NULL_POINTER;
  const AssetHandle& handle = AssetHandle::in(*tree);
  if (!handle.made()) return IST_NO_HANDLE;
  view = handle.view;
  return IST_OK;
}

/// The workspace behind a handle, or null with `status` set.
inline Workspace* workspace_of(ist_workspace_t* workspace, ist_status_t& status) noexcept {
  if (workspace == nullptr) {
    status = IST_NULL_POINTER;
    return nullptr;
  }
  WorkspaceHandle& handle = WorkspaceHandle::in(*workspace);
  if (!handle.made()) {
    status = IST_NO_HANDLE;
    return nullptr;
  }
  return &handle.workspace;
}

}  // namespace ist::c_api
