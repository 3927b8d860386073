#include <tbb/parallel_for.h>
#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstring>
#include <utility>

#include "mesh/import/polygon_mesh.h"
#include "mesh/import/text_scanner.h"

namespace ist {
namespace {

enum class Encoding { ascii, little_endian, big_endian };

template <class T>
double read_number(const char* bytes, const Encoding encoding) {
  static_assert(std::endian::native == std::endian::little);
  std::array<char, sizeof(T)> raw;
  std::memcpy(raw.data(), bytes, sizeof(T));
  if (encoding == Encoding::big_endian) std::reverse(raw.begin(), raw.end());
  return static_cast<double>(std::bit_cast<T>(raw));
}

/// A type of numbers, which has two names.
struct NumberType {
  std::string_view name, other_name;
  std::size_t size;
  double (*read)(const char* bytes, Encoding encoding);
};

template <class T>
constexpr NumberType number_type(std::string_view name, std::string_view other_name) {
  return {name, other_name, sizeof(T), read_number<T>};
}

constexpr std::array kNumberTypes = {
    number_type<std::int8_t>("char", "int8"),    number_type<std::uint8_t>("uchar", "uint8"),
    number_type<std::int16_t>("short", "int16"), number_type<std::uint16_t>("ushort", "uint16"),
    number_type<std::int32_t>("int", "int32"),   number_type<std::uint32_t>("uint", "uint32"),
    number_type<float>("float", "float32"),      number_type<double>("double", "float64"),
};

struct Property {
  std::string name;
  NumberType type{};
  bool is_list = false;
  NumberType count_type{};  ///< of a list
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

struct Header {
  Encoding encoding{};
  std::vector<Element> elements;
  std::size_t body = 0;  ///< first byte after it
  std::size_t lines = 0;
};

NumberType parse_type(const TextScanner& scanner, std::string_view word) {
  for (const NumberType& type : kNumberTypes)
    if (word == type.name || word == type.other_name) return type;
  scanner.fail("unknown property type " + in_quotes(word));
}

Encoding parse_encoding(const TextScanner& scanner, std::string_view word) {
  if (word == "ascii") return Encoding::ascii;
  if (word == "binary_little_endian") return Encoding::little_endian;
  if (word == "binary_big_endian") return Encoding::big_endian;
  scanner.fail("unknown PLY format " + in_quotes(word));
}

Header parse_header(const SourceFile& file) {
  TextScanner scanner(file, 0);
  scanner.next_line();
  if (scanner.word() != "ply") fail(file, "does not begin with \"ply\", so it is not a PLY file");
  Header header;
  bool has_format = false;
  while (scanner.next_line()) {
    const std::string_view keyword = scanner.word();
    if (keyword == "end_header") {
      if (!has_format) scanner.fail("the header names no format");
      header.body = scanner.next_line_start();
      header.lines = scanner.line();
      return header;
    }
    if (keyword == "format") {
      header.encoding = parse_encoding(scanner, scanner.word());
      has_format = true;
    } else if (keyword == "element") {
      Element element;
      element.name = scanner.word();
      const std::int64_t count = scanner.integer(scanner.word());
      if (count < 0) scanner.fail("a negative number of elements " + in_quotes(element.name));
      element.count = static_cast<std::uint64_t>(count);
      header.elements.push_back(std::move(element));
    } else if (keyword == "property") {
      if (header.elements.empty()) scanner.fail("a property before any element");
      Property property;
      std::string_view type = scanner.word();
      if (type == "list") {
        property.is_list = true;
        property.count_type = parse_type(scanner, scanner.word());
        type = scanner.word();
      }
      property.type = parse_type(scanner, type);
      property.name = scanner.word();
      header.elements.back().properties.push_back(std::move(property));
    } else if (keyword != "comment" && keyword != "obj_info" && !keyword.empty()) {
      scanner.fail("unknown header line " + in_quotes(keyword));
    }
  }
  fail(file, "the file ends early: the header has no end_header");
}

/// The values after the header, in order, whatever their encoding.
class Body {
 public:
  Body(const SourceFile& file, const Header& header)
      : file_(file),
        encoding_(header.encoding),
        position_(header.body),
        text_(file, 0, header.body, header.lines + 1) {}

  double read(const NumberType& type) {
    if (encoding_ == Encoding::ascii) {
      const std::string_view word = text_.word_anywhere();
      if (word.empty()) fail_early();
      return text_.real(word);
    }
    if (file_.bytes.size() - position_ < type.size) fail_early();
    const double value = value_at(position_, type);
    position_ += type.size;
    return value;
  }

  /// A value of a binary file, which must lie within the file.
  double value_at(std::size_t position, const NumberType& type) const {
    return type.read(file_.bytes.data() + position, encoding_);
  }

  std::uint64_t read_list_count(const Property& list) {
    const double count = read(list.count_type);
    if (!(count >= 0) || count != std::floor(count)) fail_here("a list of impossible length");
    require(static_cast<std::uint64_t>(std::min(count, 1e18)), least_bytes(list.type), "list");
    return static_cast<std::uint64_t>(count);
  }

  /// Throws unless the file is long enough for `count` records of `bytes` each.
  void require(std::uint64_t count, std::size_t bytes, const std::string& what) const {
    const std::size_t left =
        encoding_ == Encoding::ascii ? text_.bytes_left() : file_.bytes.size() - position_;
    if (bytes > 0 && count > left / bytes)
      fail_here("the file ends early: it is too short for " + std::to_string(count) + " × " + what);
  }

  /// The minimum size of a value in the file. (Text: a digit and a space, except for the last
  /// value.)
  std::size_t least_bytes(const NumberType& type) const {
    return encoding_ == Encoding::ascii ? 1 : type.size;
  }
  std::size_t least_bytes(const Element& element) const {
    std::size_t sum = 0;
    for (const Property& property : element.properties)
      sum += least_bytes(property.is_list ? property.count_type : property.type);
    return sum;
  }

  /// Skips so many records of a binary file and returns where they begin; nothing for a text file
  /// or if the file is too short.
  std::optional<std::size_t> pass_records(std::uint64_t count, std::size_t bytes) {
    if (is_text() || count > (file_.bytes.size() - position_) / bytes) return std::nullopt;
    return std::exchange(position_, position_ + count * bytes);
  }

  bool is_text() const { return encoding_ == Encoding::ascii; }
  std::size_t line() const { return text_.line(); }
  [[noreturn]] void fail_here(const std::string& what) const {
    if (is_text()) text_.fail(what);
    fail(file_, "byte " + std::to_string(position_) + ": " + what);
  }

 private:
  [[noreturn]] void fail_early() const { fail_here("the file ends early"); }

  const SourceFile& file_;
  Encoding encoding_;
  std::size_t position_;
  TextScanner text_;
};

void read_vertices(Body& body, const Element& element, PolygonMesh& mesh) {
  // The axis of each property: x, y, z, or −1.
  std::vector<int> axis_of(element.properties.size(), -1);
  std::array<bool, 3> found{};
  for (std::size_t p = 0; p < element.properties.size(); ++p) {
    const Property& property = element.properties[p];
    for (int axis = 0; axis < 3; ++axis) {
      if (property.is_list || property.name != std::string_view("xyz").substr(std::size_t(axis), 1))
        continue;
      axis_of[p] = axis;
      found[static_cast<std::size_t>(axis)] = true;
    }
  }
  if (!found[0] || !found[1] || !found[2]) body.fail_here("vertices without x, y and z");
  if (element.count > UINT32_MAX) body.fail_here("more than 2^32 vertices");
  const auto is_list = [](const Property& property) { return property.is_list; };
  if (std::none_of(element.properties.begin(), element.properties.end(), is_list)) {
    const std::size_t bytes = body.least_bytes(element);
    if (const auto start = body.pass_records(element.count, bytes)) {
      mesh.vertices.resize(element.count);
      tbb::parallel_for(std::size_t{0}, mesh.vertices.size(), [&](std::size_t i) {
        std::size_t position = *start + bytes * i;
        for (std::size_t p = 0; p < element.properties.size(); ++p) {
          const NumberType& type = element.properties[p].type;
          if (axis_of[p] >= 0) mesh.vertices[i][axis_of[p]] = body.value_at(position, type);
          position += type.size;
        }
      });
      return;
    }
  }
  mesh.vertices.reserve(element.count);
  for (std::uint64_t i = 0; i < element.count; ++i) {
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    for (std::size_t p = 0; p < element.properties.size(); ++p) {
      const Property& property = element.properties[p];
      const std::uint64_t values = property.is_list ? body.read_list_count(property) : 1;
      for (std::uint64_t k = 0; k < values; ++k) {
        const double value = body.read(property.type);
        if (axis_of[p] >= 0) position[axis_of[p]] = value;
      }
    }
    if (body.is_text() && !position.allFinite())
      mesh.line_of_nonfinite[static_cast<std::uint32_t>(i)] = body.line();
    mesh.vertices.push_back(position);
  }
}

bool is_corners(const Property& property) {
  return property.is_list && (property.name == "vertex_indices" || property.name == "vertex_index");
}

/// Reads the faces of a binary file that contains only valid triangles: records of one size.
/// Otherwise reads nothing and returns false.
bool read_triangles(Body& body, const Element& element, std::uint64_t vertex_count,
                    PolygonMesh& mesh) {
  if (body.is_text() || element.properties.size() != 1 || !is_corners(element.properties[0]))
    return false;
  const Property& list = element.properties[0];
  const std::size_t of_count = list.count_type.size, of_corner = list.type.size;
  const std::size_t bytes = of_count + 3 * of_corner;
  Body ahead = body;
  const auto start = ahead.pass_records(element.count, bytes);
  if (!start) return false;
  std::vector<std::array<std::uint32_t, 3>> triangles(element.count);
  std::atomic<bool> sound{true};
  tbb::parallel_for(std::uint64_t{0}, element.count, [&](std::uint64_t i) {
    const std::size_t position = *start + bytes * i;
    bool is_sound = body.value_at(position, list.count_type) == 3;
    for (std::size_t k = 0; k < 3; ++k) {
      const double value = body.value_at(position + of_count + of_corner * k, list.type);
      is_sound = is_sound && value >= 0 && value < static_cast<double>(vertex_count) &&
                 value == std::floor(value);
      if (is_sound) triangles[i][k] = static_cast<std::uint32_t>(value);
    }
    if (!is_sound) sound.store(false, std::memory_order_relaxed);
  });
  if (!sound) return false;
  body.pass_records(element.count, bytes);
  mesh.triangles = std::move(triangles);
  return true;
}

/// Throws Error unless the value is the index of a vertex.
std::uint32_t vertex_of(const Body& body, double value, std::uint64_t vertex_count,
                        const char* of_what, std::uint64_t index, std::uint64_t corner) {
  if (!(value >= 0) || value >= static_cast<double>(vertex_count) || value != std::floor(value))
    body.fail_here(of_what + std::to_string(index) + ": corner " + std::to_string(corner) +
                   " is not a vertex: the file has " + std::to_string(vertex_count) +
                   ", counted from 0");
  return static_cast<std::uint32_t>(value);
}

/// Strips of triangles with alternating orientation; −1 ends one.
void read_strips(Body& body, const Element& element, std::uint64_t vertex_count,
                 PolygonMesh& mesh) {
  for (std::uint64_t i = 0; i < element.count; ++i) {
    for (const Property& property : element.properties) {
      const std::uint64_t values = property.is_list ? body.read_list_count(property) : 1;
      std::uint64_t length = 0;  // of the strip so far
      std::array<std::uint32_t, 2> last{};
      for (std::uint64_t k = 0; k < values; ++k) {
        const double value = body.read(property.type);
        if (!is_corners(property)) continue;
        if (value == -1) {
          length = 0;
          continue;
        }
        const std::uint32_t v = vertex_of(body, value, vertex_count, "strip ", i, k);
        if (++length >= 3) mesh.add_triangle(last[length % 2 == 0 ? 1 : 0], last[length % 2], v);
        last = {last[1], v};
      }
    }
  }
}

void read_faces(Body& body, const Element& element, std::uint64_t vertex_count, PolygonMesh& mesh) {
  if (element.properties.empty()) return;  // empty records of any number
  if (read_triangles(body, element, vertex_count, mesh)) return;
  mesh.ends.reserve(element.count);
  mesh.corners.reserve(3 * element.count);
  for (std::uint64_t i = 0; i < element.count; ++i) {
    for (const Property& property : element.properties) {
      const std::uint64_t values = property.is_list ? body.read_list_count(property) : 1;
      const bool corners = is_corners(property);
      for (std::uint64_t k = 0; k < values; ++k) {
        const double value = body.read(property.type);
        if (!corners) continue;
        mesh.corners.push_back(vertex_of(body, value, vertex_count, "face ", i, k));
      }
      if (!corners) continue;
      if (values >= 3)
        mesh.ends.push_back(mesh.corners.size());
      else
        mesh.corners.resize(mesh.corners.size() - values);
    }
  }
}

void skip(Body& body, const Element& element) {
  if (element.properties.empty()) return;
  for (std::uint64_t i = 0; i < element.count; ++i) {
    for (const Property& property : element.properties) {
      const std::uint64_t values = property.is_list ? body.read_list_count(property) : 1;
      for (std::uint64_t k = 0; k < values; ++k) body.read(property.type);
    }
  }
}

}  // namespace

/// Polygon file format, text or binary of either byte order. Skips elements other than vertices,
/// faces and strips, and properties other than position and corners.
PolygonMesh read_ply(const SourceFile& file) {
  const Header header = parse_header(file);
  std::uint64_t vertex_count = 0;
  for (const Element& element : header.elements)
    if (element.name == "vertex") vertex_count = element.count;
  if (vertex_count > UINT32_MAX) fail(file, "more than 2^32 vertices");
  Body body(file, header);
  PolygonMesh mesh;
  bool has_vertices = false, has_faces = false;
  for (const Element& element : header.elements) {
    body.require(element.count, body.least_bytes(element), element.name);
    if (element.name == "vertex") {
      if (std::exchange(has_vertices, true)) fail(file, "the header lists vertices twice");
      read_vertices(body, element, mesh);
    } else if (element.name == "face") {
      if (std::exchange(has_faces, true)) fail(file, "the header lists faces twice");
      read_faces(body, element, vertex_count, mesh);
    } else if (element.name == "tristrips") {
      read_strips(body, element, vertex_count, mesh);
    } else {
      skip(body, element);
      if (element.count > 0 && element.name != "edge" && element.name != "material")
        mesh.notes.push_back("the element " + in_quotes(element.name) + " is not read");
    }
  }
  if (!mesh.triangles.empty() &&
      !mesh.ends.empty()) {  // some faces were read as triangles, and strips follow
    for (const auto& t : mesh.triangles) mesh.add_triangle(t[0], t[1], t[2]);
    mesh.triangles.clear();
  }
  return mesh;
}

}  // namespace ist
