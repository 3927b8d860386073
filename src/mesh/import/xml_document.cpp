#include "mesh/import/xml_document.h"

#include <algorithm>

namespace ist {
namespace {

constexpr std::string_view kSpace = " \t\r\n";
constexpr std::size_t kDeepest = 1000, kMostAttributes = 256;

}  // namespace

std::string xml_text(std::string_view text) {
  std::string out;
  for (const char c : text) {
    const bool control = static_cast<unsigned char>(c) < ' ' && c != '\n' && c != '\t';
    out += c == '&'   ? "&amp;"
           : c == '<' ? "&lt;"
           : c == '>' ? "&gt;"
           : c == '"' ? "&quot;"
           : control  ? "?"
                      : std::string(1, c);
  }
  return out;
}

XmlDocument::XmlDocument(const SourceFile& file) : file_(file), bytes_(file.bytes) {
  if (const std::size_t zero = bytes_.find('\0'); zero != std::string_view::npos)
    fail_at(zero, "a byte of 0, which XML has not: binary data, or text that is not UTF-8");
  parse();
  if (!open_.empty()) fail(open_.back().element, "the file ends early: this element is not closed");
  if (elements_.empty()) ist::fail(file_, "contains no XML element");
}

std::string_view XmlDocument::attribute(std::uint32_t element, std::string_view name) const {
  const auto first = attributes_.begin() + elements_[element].first_attribute;
  const auto last = first + elements_[element].attribute_count;
  const auto found =
      std::find_if(first, last, [&](const auto& attribute) { return attribute.first == name; });
  return found == last ? std::string_view() : found->second;
}

std::uint32_t XmlDocument::child(std::uint32_t element, std::string_view name) const {
  std::uint32_t child = elements_[element].first_child;
  while (child != kNone && elements_[child].name != name) child = elements_[child].next_sibling;
  return child;
}

void XmlDocument::fail(std::uint32_t element, const std::string& what) const {
  fail_at(elements_[element].offset,
          "<" + std::string(elements_[element].name.substr(0, 40)) + ">: " + what);
}

void XmlDocument::fail_at(std::size_t offset, const std::string& what) const {
  const auto lines =
      std::count(bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(offset), '\n');
  fail_at_line(file_, static_cast<std::size_t>(lines) + 1, what);
}

void XmlDocument::parse() {
  for (at_ = bytes_.find('<'); at_ != std::string_view::npos; at_ = bytes_.find('<', at_)) {
    const std::string_view rest = bytes_.substr(at_);
    const auto begins = [&](std::string_view text) { return rest.substr(0, text.size()) == text; };
    if (begins("<!--"))
      skip("-->", "a comment");
    else if (begins("<?"))
      skip("?>", "an instruction");
    else if (begins("<![CDATA["))
      skip("]]>", "a CDATA section");
    else if (begins("<!"))
      fail_at(at_, "document types and entities are refused. Remove them");
    else if (begins("</"))
      close_tag();
    else
      open_tag();
  }
}

void XmlDocument::skip(std::string_view end, const char* what) {
  const std::size_t found = bytes_.find(end, at_ + 2);
  if (found == std::string_view::npos)
    fail_at(at_, "the file ends early: " + std::string(what) + " is not closed");
  at_ = found + end.size();
}

void XmlDocument::open_tag() {
  if (open_.empty() && !elements_.empty()) fail_at(at_, "a second root element");
  if (open_.size() >= kDeepest)
    fail_at(at_, "elements nested more than " + std::to_string(kDeepest) + " deep");
  if (elements_.size() >= kNone) fail_at(at_, "more than 2^32 elements");
  const auto index = static_cast<std::uint32_t>(elements_.size());
  Element element;
  element.offset = at_++;
  const std::size_t end = std::min(bytes_.find_first_of(" \t\r\n/><\"'", at_), bytes_.size());
  element.name = bytes_.substr(at_, end - at_);
  if (element.name.empty() || !std::all_of(element.name.begin(), element.name.end(),
                                           [](char c) { return c > ' ' && c <= '~'; }))
    fail_at(element.offset, "a tag without a readable name");
  at_ = end;
  read_attributes(element);
  element.end = at_;
  elements_.push_back(element);
  if (!open_.empty()) {
    Open& parent = open_.back();
    (parent.last_child == kNone ? elements_[parent.element].first_child
                                : elements_[parent.last_child].next_sibling) = index;
    parent.last_child = index;
  }
  if (bytes_[at_ - 2] != '/') open_.push_back({index, kNone, at_});
}

/// Reads from the end of the name to the closing bracket.
void XmlDocument::read_attributes(Element& element) {
  element.first_attribute = static_cast<std::uint32_t>(attributes_.size());
  for (;;) {
    at_ = std::min(bytes_.find_first_not_of(kSpace, at_), bytes_.size());
    if (bytes_.substr(at_, 2) == "/>") {
      at_ += 2;
      return;
    }
    if (bytes_.substr(at_, 1) == ">") {
      ++at_;
      return;
    }
    const std::size_t name_end = bytes_.find_first_of(" \t\r\n=/><\"'", at_);
    const std::size_t equals =
        name_end == std::string_view::npos ? name_end : bytes_.find_first_not_of(kSpace, name_end);
    const std::size_t quote = equals == std::string_view::npos || bytes_[equals] != '='
                                  ? std::string_view::npos
                                  : bytes_.find_first_not_of(kSpace, equals + 1);
    if (quote == std::string_view::npos || (bytes_[quote] != '"' && bytes_[quote] != '\''))
      fail_at(element.offset, "a malformed tag, or the file ends early in it");
    const std::size_t close = bytes_.find(bytes_[quote], quote + 1);
    if (close == std::string_view::npos)
      fail_at(element.offset, "the file ends early: an attribute is not closed");
    attributes_.emplace_back(bytes_.substr(at_, name_end - at_),
                             bytes_.substr(quote + 1, close - quote - 1));
    if (++element.attribute_count > kMostAttributes)
      fail_at(element.offset,
              "a tag with more than " + std::to_string(kMostAttributes) + " attributes");
    at_ = close + 1;
  }
}

void XmlDocument::close_tag() {
  const std::size_t tag = at_;
  const std::size_t end = bytes_.find('>', at_);
  if (end == std::string_view::npos) fail_at(tag, "the file ends early in a closing tag");
  std::string_view name = bytes_.substr(at_ + 2, end - at_ - 2);
  name = name.substr(0, name.find_first_of(kSpace));
  if (open_.empty() || elements_[open_.back().element].name != name)
    fail_at(tag, "closes " + in_quotes(name) + ", which is not open");
  const Open& closed = open_.back();
  Element& element = elements_[closed.element];
  if (element.first_child == kNone)
    element.text = bytes_.substr(closed.content, tag - closed.content);
  open_.pop_back();
  at_ = element.end = end + 1;
}

}  // namespace ist
