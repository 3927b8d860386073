#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "mesh/import/source_file.h"

namespace ist {

/// The parts of a glTF 2.0 file, each checked when it is taken: nothing that the JSON claims is
/// believed before it is compared with the bytes that are there. Throws Error, or
/// nlohmann::json::exception where the JSON has another shape than glTF.
class GltfDocument {
 public:
  using Json = nlohmann::json;

  /// .glb by its first bytes, else the JSON of a .gltf. Keeps a reference to the file.
  explicit GltfDocument(const SourceFile& file);

  const Json& root() const { return root_; }
  std::vector<std::string> files() const;  ///< paths of the buffers beside the file
  /// Member `index` of the array `name` at the top level; `from` is what refers to it, for
  /// messages.
  const Json& at(const std::string& name, std::size_t index, const std::string& from) const;
  /// A whole number ≥ 0 under `key`.
  std::size_t whole(const Json& object, const std::string& key,
                    std::optional<std::size_t> fallback = std::nullopt) const;
  /// Whole numbers ≥ 0 under `key`; none if it is missing.
  std::vector<std::size_t> whole_list(const Json& object, const std::string& key) const;
  /// A number that float32 can hold, as all of glTF's are; `where` it stands, for messages.
  double real(const Json& value, const std::string& where) const;

  /// All components of an accessor, one after the other. `type` is "SCALAR", "VEC3"; a number from
  /// the binary data may be infinite or NaN. `from` as in at().
  std::vector<double> accessor(std::size_t index, std::string_view type,
                               const std::string& from) const;

  [[noreturn]] void fail(const std::string& what) const;

 private:
  std::string_view parse_container();
  void check_extensions() const;
  void load_buffers();
  std::string_view external_buffer(const std::string& uri, const std::string& name);

  const SourceFile& file_;
  Json root_;
  std::optional<std::string_view> binary_chunk_;
  std::deque<std::string> decoded_;           ///< buffers in data URIs
  std::map<std::string, std::string> files_;  ///< buffers beside the file, each read once, by path
  std::vector<std::string_view> buffers_;
};

}  // namespace ist
