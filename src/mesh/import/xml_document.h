#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "mesh/import/source_file.h"

namespace ist {

/// Escapes text for an XML or HTML file or attribute. Control characters become '?'.
std::string xml_text(std::string_view text);

/// The elements of an XML file in document order. Strict, and without the features of hostile
/// files: no document types (so no entities), no encoding but UTF-8, a bounded depth. No recursion;
/// memory is a small multiple of the file. Entities in attributes are not decoded.
class XmlDocument {
 public:
  static constexpr std::uint32_t kNone = UINT32_MAX;

  struct Element {
    std::string_view name;
    std::string_view text;  ///< of an element without children, comments included
    std::uint32_t first_child = kNone, next_sibling = kNone;
    std::uint32_t first_attribute = 0, attribute_count = 0;
    std::size_t offset = 0;  ///< [bytes] of its tag in the file
    std::size_t end = 0;     ///< [bytes] after its closing tag
  };

  /// Keeps a reference to the file. Throws Error (file, line) unless it is one closed element.
  explicit XmlDocument(const SourceFile& file);

  std::uint32_t size() const { return static_cast<std::uint32_t>(elements_.size()); }
  const Element& operator[](std::uint32_t element) const { return elements_[element]; }

  /// The value between the quotes; empty if there is none.
  std::string_view attribute(std::uint32_t element, std::string_view name) const;
  /// The first child of that name, or kNone.
  std::uint32_t child(std::uint32_t element, std::string_view name) const;

  /// Throws Error "path: line n: <name>: what".
  [[noreturn]] void fail(std::uint32_t element, const std::string& what) const;

 private:
  void parse();
  void skip(std::string_view end, const char* what);
  void open_tag();
  void close_tag();
  void read_attributes(Element& element);
  [[noreturn]] void fail_at(std::size_t offset, const std::string& what) const;

  const SourceFile& file_;
  std::string_view bytes_;
  std::size_t at_ = 0;
  std::vector<Element> elements_;
  std::vector<std::pair<std::string_view, std::string_view>> attributes_;
  struct Open {
    std::uint32_t element, last_child;
    std::size_t content;  ///< where it begins
  };
  std::vector<Open> open_;
};

}  // namespace ist
