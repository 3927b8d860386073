#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include <ist/api.h>
#include <ist/error.h>
#include <ist/tree_view.h>

namespace IST_API ist {

/// The bytes of an asset in memory, aligned to 64 bytes. Empty once moved from.
class Asset {
 public:
  /// Copies the bytes. Throws Error, naming `name`, unless TreeView::from_bytes accepts them.
  Asset(std::span<const std::byte> bytes, const std::string& name);

  Asset(Asset&& other) noexcept : Asset() { swap(other); }
  Asset& operator=(Asset&& other) noexcept {
    Asset taken(std::move(other));
    swap(taken);
    return *this;
  }

  /// Reads a file of `ist bake` or save(). Throws Error (file, what is wrong, remedy).
  static Asset load(const std::filesystem::path& path);

  /// Writes to a temporary file beside `path` and renames it: at every moment `path` is the old
  /// file or the whole new one. Throws Error. Needs ist::ist.
  void save(const std::filesystem::path& path) const;

  std::span<const std::byte> bytes() const noexcept { return {data_.get(), size_}; }
  const TreeView& view() const noexcept { return view_; }

 private:
  Asset() = default;
  void swap(Asset& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    std::swap(view_, other.view_);
  }

  struct AlignedDelete {
    void operator()(std::byte* p) const noexcept;
  };
  std::unique_ptr<std::byte[], AlignedDelete> data_;
  std::size_t size_ = 0;
  TreeView view_;
};

}  // namespace ist
