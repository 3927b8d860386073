#pragma once

#include <deque>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
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
  /// Extensions in use, though not required, of which nothing is read and that may change a shape.
  std::vector<std::string> unread_extensions() const;
  /// A small file can ask for many copies of its meshes: more corners than this are no accident.
  std::size_t most_corners() const { return 12'000'000 + file_.bytes.size(); }
  /// Member `index` of the array `name` at the top level; `from`: who refers to it.
  const Json& at(const std::string& name, std::size_t index, const std::string& from) const;
  /// A whole number ≥ 0 under `key`.
  std::size_t whole(const Json& object, const std::string& key,
                    std::optional<std::size_t> fallback = std::nullopt) const;
  /// Whole numbers ≥ 0 under `key`; none if it is missing.
  std::vector<std::size_t> whole_list(const Json& object, const std::string& key) const;
  /// A number that float32 can represent, as all of glTF's are; `where` it stands, for messages.
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
  /// Accessors may be read often, and sparse ones be short: what they make is limited in all.
  void spend(std::size_t width, std::size_t count, const std::string& name) const;

  const SourceFile& file_;
  Json root_;
  mutable std::size_t numbers_read_ = 0;
  std::optional<std::string_view> binary_chunk_;
  std::deque<std::string> decoded_;           ///< buffers in data URIs
  std::map<std::string, std::string> files_;  ///< buffers beside the file, each read once, by path
  std::vector<std::string_view> buffers_;
};

}  // namespace ist
