#include "library/cache_key.h"

#include <fmt/format.h>
#define XXH_INLINE_ALL
#include <xxhash.h>

#include <cctype>
#include <filesystem>
#include <fstream>
#include <span>
#include <string_view>
#include <type_traits>
#include <vector>

#include <ist/asset_layout.h>
#include <ist/error.h>
#include <ist/mesh.h>

#include "library/bake_revision.h"
#include "mesh/mesh_files.h"

namespace ist {
namespace {

class Hash {
 public:
  Hash() { XXH3_128bits_reset(&state_); }

  void add(const void* bytes, std::size_t count) { XXH3_128bits_update(&state_, bytes, count); }
  /// With its length, so that two texts are not one after the other.
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

/// A mesh of a format whose files we do not know counts by what it is loaded as.
void add_loaded(const std::string& path, Hash& hash) {
  const TriangleMesh mesh = load_mesh(path);
  std::vector<double> coordinates;
  coordinates.reserve(3 * mesh.vertices.size());
  for (const Eigen::Vector3d& v : mesh.vertices)
    coordinates.insert(coordinates.end(), {v.x(), v.y(), v.z()});
  hash.add_all(coordinates);
  hash.add_all(mesh.triangles);
}

}  // namespace

std::string CacheKey::text() const { return fmt::format("{:016x}{:016x}", high, low); }

CacheKey cache_key(const Job& job) {
  Hash hash;
  hash.add_text(fmt::format("format {}.{} bake {}\n{}", kFormatMajor, kFormatMinor, kBakeRevision,
                            describe_exactly(job.settings)));
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
  // Its ending says how a file is read.
  std::string ending = std::filesystem::path(job.mesh).extension().string();
  for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  hash.add_text(ending);
  for (const std::string& file : *files) hash.add_file(file);
  return hash.key();
}

}  // namespace ist
