#include "mesh/import/collada_document.h"

#include <string>

#include "mesh/import/text_scanner.h"

namespace ist {

ColladaDocument::ColladaDocument(const SourceFile& file)
    : xml_(file), most_(12'000'000 + file.bytes.size()) {
  if (xml_[0].name != "COLLADA")
    fail(file, "is not COLLADA: its root is " + in_quotes(xml_[0].name));
  for (Index i = 0; i < xml_.size(); ++i)
    if (const std::string_view id = xml_.attribute(i, "id"); !id.empty()) by_id_.emplace(id, i);
}

ColladaDocument::Index ColladaDocument::target(Index element, std::string_view attribute,
                                               std::string_view name) const {
  const std::string_view url = xml_.attribute(element, attribute);
  if (url.empty() || url[0] != '#')
    xml_.fail(element, "refers to " + in_quotes(url) + ", not to an element of this file");
  const auto found = by_id_.find(url.substr(1));
  if (found == by_id_.end() || xml_[found->second].name != name)
    xml_.fail(element, "refers to " + in_quotes(url) + ", which is not a " + std::string(name) +
                           " of this file");
  return found->second;
}

std::uint64_t ColladaDocument::whole(Index element, std::string_view attribute,
                                     const std::optional<std::uint64_t> fallback) const {
  const std::string_view text = xml_.attribute(element, attribute);
  if (text.empty() && fallback) return *fallback;
  const std::optional<std::uint64_t> value = parse_whole<std::uint64_t>(text);
  if (!value)
    xml_.fail(element,
              "its " + std::string(attribute) + " is not a whole number: " + in_quotes(text));
  return *value;
}

std::vector<double> ColladaDocument::reals(Index element) const {
  std::vector<double> values;
  for_words(xml_[element].text, [&](std::string_view word) {
    const std::optional<double> value = parse_real(word);
    if (!value) xml_.fail(element, in_quotes(word) + " is not a number");
    values.push_back(*value);
  });
  return values;
}

std::vector<double> ColladaDocument::reals(Index element, std::size_t count) const {
  std::vector<double> values = reals(element);
  if (values.size() != count)
    xml_.fail(element,
              std::to_string(values.size()) + " numbers instead of " + std::to_string(count));
  return values;
}

std::vector<std::uint64_t> ColladaDocument::wholes(Index element) const {
  std::vector<std::uint64_t> values;
  for_words(xml_[element].text, [&](std::string_view word) {
    const std::optional<std::uint64_t> value = parse_whole<std::uint64_t>(word);
    if (!value) xml_.fail(element, in_quotes(word) + " is not a whole number ≥ 0");
    values.push_back(*value);
  });
  return values;
}

}  // namespace ist
