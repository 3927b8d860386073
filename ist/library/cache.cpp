#include "library/cache.h"

#include <fmt/format.h>
#include <ist/asset_layout.h>
#include <ist/mesh.h>
#define XXH_INLINE_ALL
#include <xxhash.h>
#include <nlohmann/json.hpp>

#include <fcntl.h>
#include <sys/stat.h>
#include <algorithm>
#include <fstream>
#include <system_error>
#include <type_traits>
#include <utility>

#include "bake/asset/atomic_file.h"
#include "library/text.h"
#include "mesh/mesh_files.h"

namespace ist {
namespace {

class Hash {
 public:
  Hash() { XXH3_128bits_reset(&state_); }

  void add(const void* bytes, std::size_t count) { XXH3_128bits_update(&state_, bytes, count); }
  /// Adds the length too, so that the concatenation of two texts is unambiguous.
  void add_text(std::string_view text) {
    const std::uint64_t size = text.size();
    add(&size, sizeof(size));
    add(text.data(), text.size());
  }
  template <class T>
  void add_all(const std::vector<T>& values) {
    static_assert(std::has_unique_object_representations_v<T> || std::is_same_v<T, double>);
    add_text({reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)});
  }

  void add_file(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    if (!file) throw Error(path + ": cannot be opened. Check its permissions");
    std::vector<char> buffer(std::size_t{1} << 20);
    std::uint64_t size = 0;
    do {
      file.read(buffer.data(), static_cast<std::streamsize>(buffer.size()));
      const auto got = static_cast<std::size_t>(file.gcount());
      add(buffer.data(), got);
      size += got;
    } while (file);
    if (!file.eof()) throw Error(path + ": cannot be read");
    add(&size, sizeof(size));
  }

  CacheKey key() const {
    const XXH128_hash_t hash = XXH3_128bits_digest(&state_);
    return {hash.high64, hash.low64};
  }

 private:
  XXH3_state_t state_;
};

/// A mesh of an unknown format is hashed by its loaded data.
void add_loaded(const std::string& path, Hash& hash) {
  const TriangleMesh mesh = load_mesh(path);
  std::vector<double> coordinates;
  coordinates.reserve(3 * mesh.vertices.size());
  for (const Eigen::Vector3d& v : mesh.vertices)
    coordinates.insert(coordinates.end(), {v.x(), v.y(), v.z()});
  hash.add_all(coordinates);
  hash.add_all(mesh.triangles);
}

namespace fs = std::filesystem;

using Json = nlohmann::ordered_json;

constexpr int kEntryFormat = 3;  ///< entries of other formats are ignored

/// The hash of a line's other fields and of the asset.
std::string hash_of(const Json& line, const Asset& asset) {
  Hash hash;
  hash.add_text(json_text(line, -1));
  hash.add(asset.bytes().data(), asset.bytes().size());
  return hash.key().text();
}

std::optional<std::string> read_file(const fs::path& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) return std::nullopt;
  const std::streamoff size = file.tellg();
  if (size < 0) return std::nullopt;
  std::string bytes(static_cast<std::size_t>(size), '\0');
  file.seekg(0);
  if (!file.read(bytes.data(), size)) return std::nullopt;
  return bytes;
}

constexpr std::size_t kKeyDigits = 32;
constexpr std::string_view kEnding = ".entry";

/// The kind of a file of the cache, by its name alone.
enum class Kind { other, entry, left_over };
Kind kind_of(const std::string& name) {
  constexpr std::size_t kWhole = kKeyDigits + kEnding.size();
  if (name.size() < kWhole || name.compare(kKeyDigits, kEnding.size(), kEnding) != 0 ||
      name.find_first_not_of("0123456789abcdef") != kKeyDigits)
    return Kind::other;
  if (name.size() == kWhole) return Kind::entry;
  // The suffix that write_atomically() appends.
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

/// Skips files that other processes remove meanwhile.
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

std::string CacheKey::text() const { return fmt::format("{:016x}{:016x}", high, low); }

CacheKey cache_key(const Job& job) {
  Hash hash;
  hash.add_text(fmt::format("format {}.{} bake {} entry {}\n{}", kFormatMajor, kFormatMinor,
                            kBakeRevision, kEntryFormat, describe_exactly(job.settings)));
  if (job.shape) {
    const Eigen::Vector3d &s = std::get<LinkMesh>(job.shape->shape).scale,
                          &t = job.shape->translation;
    const Eigen::Vector4d& q = job.shape->rotation.coeffs();
    hash.add_text(fmt::format("link {} {} {} {} {} {} {} {} {} {}", s.x(), s.y(), s.z(), q.x(),
                              q.y(), q.z(), q.w(), t.x(), t.y(), t.z()));
  }
  const auto files = files_of_mesh(job.mesh);
  if (!files) {
    hash.add_text("loaded");
    add_loaded(job.mesh, hash);
    return hash.key();
  }
  // The extension determines how a file is read.
  hash.add_text(ending_of(job.mesh));
  for (const std::string& file : *files) hash.add_file(file);
  return hash.key();
}

std::string line_of(const CacheKey& key, const CacheEntry& entry) {
  Json line = {{"key", key.text()}, {"notes", entry.notes}, {"confidence", nullptr}};
  if (entry.confidence) line["confidence"] = *entry.confidence;
  line["hash"] = hash_of(line, entry.asset);
  return json_text(line, -1);
}

CacheEntry entry_from(std::string_view text, const CacheKey& key, Asset asset) {
  Json line = Json::parse(text, nullptr, false);
  if (!line.contains("hash")) throw Error("the entry's first line is damaged");
  const Json hash = line["hash"];
  line.erase("hash");
  if (hash != hash_of(line, asset)) throw Error("the entry does not match its checksum");
  if (line.at("key") != key.text()) throw Error("the entry belongs to another mesh");
  CacheEntry entry = {std::move(asset), line.at("notes").get<std::vector<std::string>>()};
  if (const Json& confidence = line.at("confidence"); !confidence.is_null())
    entry.confidence = confidence.get<double>();
  return entry;
}

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
  const std::optional<std::string> bytes = read_file(path);
  if (!bytes) return std::nullopt;
  try {
    const std::size_t line = bytes->find('\n');
    if (line == std::string::npos) throw Error("the entry is truncated");
    CacheEntry entry =
        entry_from(std::string_view(*bytes).substr(0, line), key,
                   Asset(std::as_bytes(std::span(*bytes)).subspan(line + 1), "the asset"));
    utimensat(AT_FDCWD, path.c_str(), nullptr, 0);  // ignores failure: the cache may be read-only
    return entry;
  } catch (const std::exception& error) {
    damage = fmt::format("{}: {}", path.string(), error.what());
    return std::nullopt;
  }
}

void AssetCache::store(const CacheKey& key, const CacheEntry& entry) {
  const std::span<const std::byte> asset = entry.asset.bytes();
  std::string bytes = line_of(key, entry) + '\n';
  bytes.append(reinterpret_cast<const char*>(asset.data()), asset.size());
  const fs::path path = file_of(key);
  std::error_code error;
  fs::create_directory(path.parent_path(), error);
  write_atomically(path, bytes);

  constexpr std::uint64_t kShare = 16;  // of the limit: it may be exceeded by this share
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
  constexpr double kAbandoned = 3600;  // [s] a file written to longer ago is abandoned
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
    if (!removed) continue;  // another process removed it
    ++pruned.entries;
    pruned.bytes += file.bytes;
  }
  return pruned;
}

}  // namespace ist
