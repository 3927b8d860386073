#pragma once

#include <optional>
#include <unordered_map>

#include "mesh/import/polygon_mesh.h"
#include "mesh/import/xml_document.h"

namespace ist {

/// The elements of a COLLADA file, their references and their lists of numbers.
class ColladaDocument {
 public:
  using Index = std::uint32_t;
  static constexpr Index kNone = XmlDocument::kNone;

  explicit ColladaDocument(const SourceFile& file);

  const XmlDocument& xml() const { return xml_; }

  /// The element of the given name that an attribute refers to.
  Index target(Index element, std::string_view attribute, std::string_view name) const;

  /// An attribute as a whole number ≥ 0.
  std::uint64_t whole(Index element, std::string_view attribute,
                      std::optional<std::uint64_t> fallback = std::nullopt) const;

  std::vector<double> reals(Index element) const;
  std::vector<double> reals(Index element, std::size_t count) const;
  std::vector<std::uint64_t> wholes(Index element) const;

  /// A limit on the corners or numbers that a file may expand to: a small file can instance its
  /// meshes many times, but more than this is malicious or damaged.
  std::size_t most() const { return most_; }

 private:
  const XmlDocument xml_;
  const std::size_t most_;
  std::unordered_map<std::string_view, Index> by_id_;
};

class ColladaGeometries {
 public:
  explicit ColladaGeometries(const ColladaDocument& document) : document_(document) {}

  /// Returns a geometry in its own frame; reads it only once.
  const PolygonMesh& operator[](std::uint32_t geometry);

 private:
  const ColladaDocument& document_;
  std::unordered_map<std::uint32_t, PolygonMesh> read_;
  std::size_t numbers_read_ = 0;
};

inline constexpr ColladaDocument::Index kNoElement = ColladaDocument::kNone;

}  // namespace ist
