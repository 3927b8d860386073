#include "mesh/import/collada_document.h"

#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <utility>

#include "mesh/import/text_scanner.h"

namespace ist {
namespace {

using Index = ColladaDocument::Index;
constexpr std::uint64_t kWidest = 255;  // inputs of a corner

class GeometryReader {
 public:
  GeometryReader(const ColladaDocument& document, std::size_t& numbers_read)
      : document_(document), xml_(document.xml()), numbers_read_(numbers_read) {}

  PolygonMesh read(Index geometry) {
    const Index source = xml_.child(geometry, "mesh");
    if (source == kNoElement) {  // a spline has no faces
      for (const char* const solid : {"convex_mesh", "brep"})
        if (xml_.child(geometry, solid) != kNoElement)
          mesh_.notes.push_back("a geometry is not read: it is a " + std::string(solid));
      return std::move(mesh_);
    }
    for (Index child = xml_[source].first_child; child != kNoElement;
         child = xml_[child].next_sibling) {
      const std::string_view name = xml_[child].name;
      if (name == "triangles" || name == "polylist" || name == "polygons" || name == "tristrips" ||
          name == "trifans")
        append_primitive(child);
    }
    return std::move(mesh_);
  }

 private:
  std::vector<Eigen::Vector3d> positions(Index vertices) {
    Index input = xml_[vertices].first_child;
    while (input != kNoElement && xml_.attribute(input, "semantic") != "POSITION")
      input = xml_[input].next_sibling;
    if (input == kNoElement) xml_.fail(vertices, "has no positions");
    const Index source = document_.target(input, "source", "source");
    const Index common = xml_.child(source, "technique_common");
    const Index accessor = common == kNoElement ? kNoElement : xml_.child(common, "accessor");
    if (accessor == kNoElement) xml_.fail(source, "has no accessor");
    const std::vector<double> values =
        document_.reals(document_.target(accessor, "source", "float_array"));
    numbers_read_ += values.size();
    if (numbers_read_ > document_.most())
      xml_.fail(vertices, "the same array is used too often. Export each mesh once");

    std::array<std::uint64_t, 3> at{0, 1, 2};
    std::uint64_t place = 0, parameters = 0;
    for (Index param = xml_[accessor].first_child; param != kNoElement;
         param = xml_[param].next_sibling, ++place) {
      const std::string_view name = xml_.attribute(param, "name");
      for (std::size_t k = 0; k < 3; ++k)
        if (name == std::string_view("XYZ").substr(k, 1)) at[k] = place, ++parameters;
    }
    if (parameters != 0 && parameters != 3) xml_.fail(accessor, "must name X, Y and Z once each");
    const std::uint64_t count = document_.whole(accessor, "count", std::nullopt);
    const std::uint64_t stride = document_.whole(accessor, "stride", 1),
                        offset = document_.whole(accessor, "offset", 0);
    const std::uint64_t last = std::max({at[0], at[1], at[2]});
    if (last >= stride) xml_.fail(accessor, "its stride is too small for X, Y and Z");
    if (count > UINT32_MAX || offset > values.size() ||
        (count > 0 && ((values.size() - offset) / stride < count - 1 ||
                       values.size() - offset - (count - 1) * stride <= last)))
      xml_.fail(accessor, std::to_string(count) + " vertices do not fit into an array of " +
                              std::to_string(values.size()) + " numbers");
    std::vector<Eigen::Vector3d> result;
    result.reserve(count);
    for (std::uint64_t i = 0; i < count; ++i) {
      const double* const v = values.data() + offset + i * stride;
      result.emplace_back(v[at[0]], v[at[1]], v[at[2]]);
    }
    return result;
  }

  void append_primitive(Index element) {
    std::uint64_t width = 1;
    std::optional<std::uint64_t> vertex_at;
    Index vertices = kNoElement;
    for (Index input = xml_[element].first_child; input != kNoElement;
         input = xml_[input].next_sibling) {
      if (xml_[input].name != "input") continue;
      const std::uint64_t offset = document_.whole(input, "offset", 0);
      if (offset > kWidest) xml_.fail(input, "its offset is beyond " + std::to_string(kWidest));
      width = std::max(width, offset + 1);
      if (xml_.attribute(input, "semantic") != "VERTEX") continue;
      vertex_at = offset;
      vertices = document_.target(input, "source", "vertices");
    }
    if (!vertex_at) return;  // no corners, no faces
    const auto [found, is_new] =
        read_.try_emplace(vertices, Vertices{static_cast<Index>(mesh_.vertices.size()), 0});
    if (is_new) {
      const std::vector<Eigen::Vector3d> more = positions(vertices);
      mesh_.vertices.insert(mesh_.vertices.end(), more.begin(), more.end());
      if (mesh_.vertices.size() > UINT32_MAX) xml_.fail(vertices, "more than 2^32 vertices");
      found->second.count = more.size();
    }
    const Corners corners{width, *vertex_at, found->second.first, found->second.count};

    const std::string_view name = xml_[element].name;
    std::vector<std::uint64_t> sizes;  // of a polylist's polygons
    if (name == "polylist") {
      const Index counts = xml_.child(element, "vcount");
      if (counts == kNoElement) xml_.fail(element, "has no vcount");
      sizes = document_.wholes(counts);
    }
    std::uint64_t faces = 0;
    bool has_corners = false;
    for (Index child = xml_[element].first_child; child != kNoElement;
         child = xml_[child].next_sibling) {
      if (xml_[child].name == "ph") xml_.fail(child, "polygons with holes are not supported");
      if (xml_[child].name != "p") continue;
      if (name == "polylist" && std::exchange(has_corners, true))
        xml_.fail(child, "a second list of corners");
      const std::vector<Index> p = corner_indices(child, corners);
      const std::size_t n = p.size();
      if (name == "triangles") {
        if (n % 3 != 0)
          xml_.fail(child, std::to_string(n) + " corners are not a multiple of three");
        for (std::size_t i = 0; i < n; i += 3) mesh_.add_triangle(p[i], p[i + 1], p[i + 2]);
        faces += n / 3;
      } else if (name == "tristrips") {
        for (std::size_t i = 0; i + 2 < n; ++i)
          mesh_.add_triangle(p[i], p[i + 1 + i % 2], p[i + 2 - i % 2]);
        ++faces;
      } else if (name == "trifans") {
        for (std::size_t i = 1; i + 1 < n; ++i) mesh_.add_triangle(p[0], p[i], p[i + 1]);
        ++faces;
      } else if (name == "polygons") {
        add_polygon(p, 0, n);
        ++faces;
      } else {
        std::size_t begin = 0;
        for (const std::uint64_t size : sizes) {
          if (size > n - begin) xml_.fail(child, "holds fewer corners than vcount announces");
          add_polygon(p, begin, size);
          begin += size;
        }
        if (begin != n) xml_.fail(child, "holds more corners than vcount announces");
        faces += sizes.size();
      }
    }
    const std::uint64_t announced = document_.whole(element, "count", faces);
    if (announced != faces)
      xml_.fail(element,
                "announces " + std::to_string(announced) + " and holds " + std::to_string(faces));
  }

  struct Corners {
    std::uint64_t width, vertex_at;
    Index first;
    std::uint64_t vertex_count;
  };

  std::vector<Index> corner_indices(Index p, const Corners& corners) const {
    const std::vector<std::uint64_t> all = document_.wholes(p);
    if (all.size() % corners.width != 0)
      xml_.fail(p, std::to_string(all.size()) + " indices for corners of " +
                       std::to_string(corners.width) + " each");
    std::vector<Index> result;
    result.reserve(all.size() / corners.width);
    for (std::size_t i = corners.vertex_at; i < all.size(); i += corners.width) {
      if (all[i] >= corners.vertex_count)
        xml_.fail(p, "refers to vertex " + std::to_string(all[i]) + " of " +
                         std::to_string(corners.vertex_count) + ", counted from 0");
      result.push_back(static_cast<Index>(corners.first + all[i]));
    }
    return result;
  }

  void add_polygon(const std::vector<Index>& p, std::size_t begin, std::size_t size) {
    if (size < 3) return;  // points and lines
    mesh_.corners.insert(mesh_.corners.end(), p.begin() + static_cast<std::ptrdiff_t>(begin),
                         p.begin() + static_cast<std::ptrdiff_t>(begin + size));
    mesh_.ends.push_back(mesh_.corners.size());
  }

  struct Vertices {
    Index first;  ///< in the mesh
    std::uint64_t count;
  };

  const ColladaDocument& document_;
  const XmlDocument& xml_;
  std::size_t& numbers_read_;
  std::map<Index, Vertices> read_;  ///< by <vertices>
  PolygonMesh mesh_;
};

}  // namespace

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

const PolygonMesh& ColladaGeometries::operator[](std::uint32_t geometry) {
  const auto found = read_.find(geometry);
  if (found != read_.end()) return found->second;
  return read_.emplace(geometry, GeometryReader(document_, numbers_read_).read(geometry))
      .first->second;
}

}  // namespace ist
