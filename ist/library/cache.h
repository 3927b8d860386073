#pragma once

#include <ist/bake.h>
#include <atomic>
#include <filesystem>
#include <string_view>

#include "library/job.h"

// A folder of assets by what they were baked from. Any number of processes and hosts may share it,
// and any of them may die at any moment: an entry is a file that has its name only once it is whole
// and on the disk, nothing is locked, and what is read is held against its hash.
//
//   DIR/ab/abcdef….entry   the entry of the key abcdef…: its line, and after that the asset

namespace ist {

/// Identifies the bytes of an asset by a hash of 128 bits.
struct CacheKey {
  std::uint64_t high = 0, low = 0;

  std::string text() const;  ///< 32 hex digits
  bool operator==(const CacheKey&) const = default;
};

/// Hashes the bytes of the mesh and of the files that it refers to, the settings, the asset's
/// format and the revision of the bake, but not name, path, device and threads. Throws Error if a
/// file cannot be read.
CacheKey cache_key(const Job& job);

struct CacheEntry {
  Asset asset;
  std::vector<std::string> notes;         ///< MeshReport::notes of the mesh
  std::optional<double> confidence = {};  ///< RepairQuality's, of a mesh that was not closed
};

/// An entry without its asset as a line of JSON: key, notes, confidence; a hash of these and the
/// asset.
std::string line_of(const CacheKey& key, const CacheEntry& entry);
/// The entry of such a line. Throws an exception that says what is wrong where the line is damaged,
/// or is another key's or another asset's.
CacheEntry entry_from(std::string_view line, const CacheKey& key, Asset asset);

class AssetCache {
 public:
  /// `limit` [bytes]: as storing goes on, entries that were not used for longest are removed; 0:
  /// none are. Makes the folder; throws Error where that cannot be.
  explicit AssetCache(std::filesystem::path folder, std::uint64_t limit = 0);

  /// Nothing where there is no such entry or it is damaged, as `damage` says. Marks it used.
  /// Thread-safe.
  std::optional<CacheEntry> find(const CacheKey& key, std::string& damage) const;

  /// In place of an entry that may be there. Throws Error. From any thread.
  void store(const CacheKey& key, const CacheEntry& entry);

 private:
  std::filesystem::path file_of(const CacheKey& key) const;

  const std::filesystem::path folder_;
  const std::uint64_t limit_;
  std::atomic<std::uint64_t> stored_ = 0;  ///< [bytes] since the limit was last looked after
};

struct CacheUse {
  std::uint64_t entries = 0, bytes = 0;
  std::uint64_t left_over = 0, left_over_bytes = 0;  ///< files that a killed program left
  double oldest = 0, newest = 0;                     ///< [s] ago, when entries were last used
};

/// Throws Error where there is no such folder.
CacheUse look_at_cache(const std::filesystem::path& folder);

struct Pruned {
  std::uint64_t entries = 0, bytes = 0;  ///< removed
};

/// Removes what a killed program left an hour ago or more, and, until `most` bytes are left, the
/// entries that were not used for longest; files that are no cache's stay. Throws Error as above.
Pruned prune_cache(const std::filesystem::path& folder, std::optional<std::uint64_t> most);

/// Raise it with every change by which some mesh and settings give other bytes than before: older
/// entries of a cache are then skipped.
/// The tests compare the hash below with that of tests/soak/bake_hashes.csv, whose hashes of assets
/// change then too: after writing new ones there, raise the one and copy the other.
inline constexpr std::uint32_t kBakeRevision = 9;
inline constexpr std::uint64_t kBakeHashesOfRevision = 1833951002004931908u;

}  // namespace ist
