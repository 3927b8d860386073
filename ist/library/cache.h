#pragma once

#include <ist/bake.h>
#include <atomic>
#include <filesystem>
#include <string_view>

#include "library/job.h"

// A folder of assets, keyed by their inputs. Any number of processes and hosts may share it, and
// any of them may die at any moment: an entry gets its name only after it is completely on disk,
// nothing is locked, and everything read is verified by its hash.
//
//   DIR/ab/abcdef….entry   the entry of the key abcdef…: its line, followed by the asset

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
  std::optional<double> confidence = {};  ///< RepairQuality's, for a mesh that was open
};

/// An entry without its asset as a line of JSON: key, notes, confidence; a hash of these and the
/// asset.
std::string line_of(const CacheKey& key, const CacheEntry& entry);
/// Parses such a line. Throws an exception that describes the fault if the line is damaged, or
/// belongs to another key or asset.
CacheEntry entry_from(std::string_view line, const CacheKey& key, Asset asset);

class AssetCache {
 public:
  /// `limit` [bytes]: storing removes the least recently used entries beyond it; 0: none. Creates
  /// the folder; throws Error if that fails.
  explicit AssetCache(std::filesystem::path folder, std::uint64_t limit = 0);

  /// Nothing if there is no such entry, or if it is damaged (then `damage` describes it). Marks it
  /// as used. Thread-safe.
  std::optional<CacheEntry> find(const CacheKey& key, std::string& damage) const;

  /// Replaces an existing entry. Throws Error. Thread-safe.
  void store(const CacheKey& key, const CacheEntry& entry);

 private:
  std::filesystem::path file_of(const CacheKey& key) const;

  const std::filesystem::path folder_;
  const std::uint64_t limit_;
  std::atomic<std::uint64_t> stored_ = 0;  ///< [bytes] since the limit was last checked
};

struct CacheUse {
  std::uint64_t entries = 0, bytes = 0;
  std::uint64_t left_over = 0, left_over_bytes = 0;  ///< files left by a killed program
  double oldest = 0, newest = 0;  ///< [s] since the least and the most recent use
};

/// Throws Error if there is no such folder.
CacheUse look_at_cache(const std::filesystem::path& folder);

struct Pruned {
  std::uint64_t entries = 0, bytes = 0;  ///< removed
};

/// Removes files that a killed program left an hour ago or more, and the least recently used
/// entries until `most` bytes are left; other files stay. Throws Error as above.
Pruned prune_cache(const std::filesystem::path& folder, std::optional<std::uint64_t> most);

/// Raise this with every change by which some mesh and settings give other bytes than before: then
/// older entries of a cache are skipped. The tests compare the hash below with that of
/// tests/soak/bake_hashes.csv, whose hashes of assets change too: after writing new ones there,
/// raise the revision and copy the hash.
inline constexpr std::uint32_t kBakeRevision = 10;
inline constexpr std::uint64_t kBakeHashesOfRevision = 12066312418792292817u;

}  // namespace ist
