#include "library/cache.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#define XXH_INLINE_ALL
#include <xxhash.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <span>
#include <system_error>
#include <utility>

#include <ist/error.h>

#include "bake/asset/atomic_file.h"

namespace ist {
namespace {

namespace fs = std::filesystem;

constexpr char kMagic[8] = {'I', 'S', 'T', 'C', 'A', 'C', 'H', 'E'};
constexpr std::uint64_t kEntryVersion = 2;

/// The start of an entry; a JSON object of what was found about the mesh, and the asset follow.
struct EntryHeader {
  char magic[8];
  std::uint64_t version;
  std::uint64_t hash_high, hash_low;  ///< XXH3-128 of all that follows this field
  std::uint64_t key_high, key_low;
  std::uint64_t found_bytes, asset_bytes;
};
static_assert(sizeof(EntryHeader) == 64);
constexpr std::size_t kHashed = offsetof(EntryHeader, key_high);

XXH128_hash_t hash_of(std::span<const std::byte> entry) {
  return XXH3_128bits(entry.data() + kHashed, entry.size() - kHashed);
}

/// Throws Error that says what is wrong with the bytes.
CacheEntry parse(const std::vector<std::byte>& bytes, const CacheKey& key) {
  EntryHeader header;
  if (bytes.size() < sizeof(header)) throw Error("the entry is truncated");
  std::memcpy(&header, bytes.data(), sizeof(header));
  if (std::memcmp(header.magic, kMagic, sizeof(kMagic)) != 0 || header.version != kEntryVersion)
    throw Error("the entry is of another version");
  const XXH128_hash_t hash = hash_of(bytes);
  if (hash.high64 != header.hash_high || hash.low64 != header.hash_low)
    throw Error("the entry does not match its checksum");
  const std::uint64_t rest = bytes.size() - sizeof(header);
  if (header.found_bytes > rest || header.asset_bytes != rest - header.found_bytes ||
      CacheKey{header.key_high, header.key_low} != key)
    throw Error("the entry belongs to another mesh");
  const auto* const text = reinterpret_cast<const char*>(bytes.data() + sizeof(header));
  const nlohmann::json found = nlohmann::json::parse(text, text + header.found_bytes);
  CacheEntry entry = {
      Asset(std::span(bytes).subspan(sizeof(header) + header.found_bytes), "the asset"),
      found.at("notes").get<std::vector<std::string>>()};
  if (const auto& confidence = found.at("confidence"); !confidence.is_null())
    entry.confidence = confidence.get<double>();
  return entry;
}

std::optional<std::vector<std::byte>> read_file(const fs::path& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) return std::nullopt;
  const std::streamoff size = file.tellg();
  if (size < 0) return std::nullopt;
  std::vector<std::byte> bytes(static_cast<std::size_t>(size));
  file.seekg(0);
  if (!file.read(reinterpret_cast<char*>(bytes.data()), size)) return std::nullopt;
  return bytes;
}

constexpr std::size_t kKeyDigits = 32;
constexpr std::string_view kEnding = ".entry";

/// A file of the cache, by its name alone.
enum class Kind { other, entry, left_over };
Kind kind_of(const std::string& name) {
  constexpr std::size_t kWhole = kKeyDigits + kEnding.size();
  if (name.size() < kWhole || name.compare(kKeyDigits, kEnding.size(), kEnding) != 0 ||
      name.find_first_not_of("0123456789abcdef") != kKeyDigits)
    return Kind::other;
  if (name.size() == kWhole) return Kind::entry;
  // What write_atomically() appends.
  return name[kWhole] == '.' && name.find_first_not_of("0123456789.", kWhole) == std::string::npos
             ? Kind::left_over
             : Kind::other;
}

struct CacheFile {
  fs::path path;
  Kind kind;
  std::uint64_t bytes;
  double unused;  ///< [s]
};

/// Files that others remove meanwhile are passed over.
std::vector<CacheFile> files_of(const fs::path& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error))
    throw Error(folder.string() +
                ": no such folder; `ist bake --manifest … --cache DIR` creates one");
  std::vector<CacheFile> files;
  timespec now = {};
  clock_gettime(CLOCK_REALTIME, &now);
  for (fs::directory_iterator part(folder, error), end; !error && part != end;
       part.increment(error)) {
    if (part->path().filename().string().size() != 2) continue;
    std::error_code inner;
    for (fs::directory_iterator entry(part->path(), inner); !inner && entry != end;
         entry.increment(inner)) {
      const Kind kind = kind_of(entry->path().filename().string());
      struct stat status = {};
      if (kind == Kind::other || lstat(entry->path().c_str(), &status) != 0 ||
          !S_ISREG(status.st_mode))
        continue;
      const double unused = static_cast<double>(now.tv_sec - status.st_mtim.tv_sec) +
                            1e-9 * static_cast<double>(now.tv_nsec - status.st_mtim.tv_nsec);
      files.push_back({entry->path(), kind, static_cast<std::uint64_t>(status.st_size), unused});
    }
  }
  if (error) throw Error(folder.string() + ": cannot be listed: " + error.message());
  return files;
}

}  // namespace

AssetCache::AssetCache(fs::path folder, std::uint64_t limit)
    : folder_(std::move(folder)), limit_(limit) {
  std::error_code error;
  fs::create_directories(folder_, error);
  if (!fs::is_directory(folder_))
    throw Error(folder_.string() + ": cannot create the cache folder: " + error.message());
}

fs::path AssetCache::file_of(const CacheKey& key) const {
  const std::string text = key.text();
  return folder_ / text.substr(0, 2) / (text + std::string(kEnding));
}

std::optional<CacheEntry> AssetCache::find(const CacheKey& key, std::string& damage) const {
  const fs::path path = file_of(key);
  const std::optional<std::vector<std::byte>> bytes = read_file(path);
  if (!bytes) return std::nullopt;
  try {
    CacheEntry entry = parse(*bytes, key);
    utimensat(AT_FDCWD, path.c_str(), nullptr, 0);  // a cache that may only be read is one too
    return entry;
  } catch (const std::exception& error) {
    damage = fmt::format("{}: {}", path.string(), error.what());
    return std::nullopt;
  }
}

void AssetCache::store(const CacheKey& key, const CacheEntry& entry) {
  nlohmann::json about = {{"notes", entry.notes}, {"confidence", nullptr}};
  if (entry.confidence) about["confidence"] = *entry.confidence;
  const std::string found = about.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  const std::span<const std::byte> asset = entry.asset.bytes();
  EntryHeader header = {};
  std::memcpy(header.magic, kMagic, sizeof(kMagic));
  header.version = kEntryVersion;
  header.key_high = key.high;
  header.key_low = key.low;
  header.found_bytes = found.size();
  header.asset_bytes = asset.size();
  std::vector<std::byte> bytes(sizeof(header) + found.size() + asset.size());
  std::memcpy(bytes.data(), &header, sizeof(header));
  std::memcpy(bytes.data() + sizeof(header), found.data(), found.size());
  std::memcpy(bytes.data() + sizeof(header) + found.size(), asset.data(), asset.size());
  const XXH128_hash_t hash = hash_of(bytes);
  header.hash_high = hash.high64;
  header.hash_low = hash.low64;
  std::memcpy(bytes.data(), &header, sizeof(header));

  const fs::path path = file_of(key);
  std::error_code error;
  fs::create_directory(path.parent_path(), error);
  write_atomically(path, bytes);

  constexpr std::uint64_t kShare = 16;  // of the limit: by so much it may be passed
  if (limit_ == 0) return;
  if (stored_.fetch_add(bytes.size()) + bytes.size() <= limit_ / kShare) return;
  stored_ = 0;
  prune_cache(folder_, limit_);
}

CacheUse look_at_cache(const fs::path& folder) {
  CacheUse use;
  for (const CacheFile& file : files_of(folder)) {
    if (file.kind == Kind::left_over) {
      ++use.left_over;
      use.left_over_bytes += file.bytes;
      continue;
    }
    use.oldest = use.entries == 0 ? file.unused : std::max(use.oldest, file.unused);
    use.newest = use.entries == 0 ? file.unused : std::min(use.newest, file.unused);
    ++use.entries;
    use.bytes += file.bytes;
  }
  return use;
}

Pruned prune_cache(const fs::path& folder, std::optional<std::uint64_t> most) {
  constexpr double kAbandoned = 3600;  // [s] no file is written for so long
  std::vector<CacheFile> files = files_of(folder);
  std::sort(files.begin(), files.end(),
            [](const CacheFile& a, const CacheFile& b) { return a.unused > b.unused; });
  std::uint64_t bytes = 0;
  for (const CacheFile& file : files) bytes += file.kind == Kind::entry ? file.bytes : 0;
  Pruned pruned;
  for (const CacheFile& file : files) {
    const bool is_entry = file.kind == Kind::entry;
    if (is_entry ? !most || bytes <= *most : file.unused < kAbandoned) continue;
    std::error_code error;
    const bool removed = fs::remove(file.path, error);
    if (error) continue;
    if (is_entry) bytes -= file.bytes;
    if (!removed) continue;  // by another, meanwhile
    ++pruned.entries;
    pruned.bytes += file.bytes;
  }
  return pruned;
}

}  // namespace ist
