#pragma once

#include <deque>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "mesh/import/source_file.h"

namespace ist {

/// The parts of a glTF 2.0 file, each checked on access: every number in the JSON is compared with
/// the available bytes before it is used. Throws Error, or nlohmann::json::exception if the JSON
/// does not have glTF's structure.
class GltfDocument {
 public:
  using Json = nlohmann::json;

  /// Detects .glb by its first bytes; otherwise reads the JSON of a .gltf. Keeps a reference to the
  /// file.
  explicit GltfDocument(const SourceFile& file);

  const Json& root() const { return root_; }
  std::vector<std::string> files() const;  ///< paths of the buffers beside the file
  /// Optional extensions in use that are not read and may change a shape.
  std::vector<std::string> unread_extensions() const;
  /// A limit of corners: a small file can instance its meshes many times, but more is malicious or
  /// damaged.
  std::size_t most_corners() const { return 12'000'000 + file_.bytes.size(); }
  /// Member `index` of the top-level array `name`; `from`: the referring object, for messages.
  const Json& at(const std::string& name, std::size_t index, const std::string& from) const;
  std::size_t whole(const Json& object, const std::string& key,
                    std::optional<std::size_t> fallback = std::nullopt) const;
  /// Nonnegative integers under `key`; none if it is missing.
  std::vector<std::size_t> whole_list(const Json& object, const std::string& key) const;
  /// A number that float32 can represent, like all of glTF's; `where`: its position, for messages.
  double real(const Json& value, const std::string& where) const;

  /// All components of an accessor, one after the other. `type` is "SCALAR", "VEC3", "VEC4" or
  /// "MAT4" (by columns); a number from the binary data may be infinite or NaN. `from` as in at().
  std::vector<double> accessor(std::size_t index, std::string_view type,
                               const std::string& from) const;

  [[noreturn]] void fail(const std::string& what) const;

 private:
  std::string_view parse_container();
  void check_extensions() const;
  void load_buffers();
  std::string_view external_buffer(const std::string& uri, const std::string& name);

  /// `count` elements from the buffer view of `where`, of the component type of another object.
  std::vector<double> numbers(const Json& where, const Json& type_owner, std::string_view type,
                              std::size_t count, const std::string& name) const;
  /// Limits the total size of accessors: a file may read them often, and sparse ones take few
  /// bytes.
  void spend(std::size_t width, std::size_t count, const std::string& name) const;

  const SourceFile& file_;
  Json root_;
  mutable std::size_t numbers_read_ = 0;
  std::optional<std::string_view> binary_chunk_;
  std::deque<std::string> decoded_;           ///< buffers from data URIs
  std::map<std::string, std::string> files_;  ///< buffers beside the file, each read once, by path
  std::vector<std::string_view> buffers_;
};

}  // namespace ist
