#include <set>

#include "mesh/import/polygon_mesh.h"
#include "mesh/import/text_scanner.h"

namespace ist {
namespace {

/// The vertex of a corner "v", "v/vt", "v//vn" or "v/vt/vn": counted from 1, or backwards from −1.
std::int64_t vertex_of_corner(const TextScanner& scanner, std::string_view corner) {
  return scanner.integer(corner.substr(0, corner.find('/')));
}

/// Statements other than `f` that define or include a surface.
bool is_surface(std::string_view keyword) {
  return keyword == "surf" || keyword == "bsp" || keyword == "bzp" || keyword == "cdp" ||
         keyword == "call";
}

}  // namespace

/// Wavefront OBJ: `v` and `f`, with backslashes at line ends. Reports other surfaces in notes,
/// skips the rest.
PolygonMesh read_obj(const SourceFile& file) {
  if (file.bytes.find('\0') != std::string::npos)
    fail(file, "holds binary data, so it is not an OBJ file. Give it the ending of its format");
  TextScanner scanner(file, '#');
  // The next word, across a backslash at the end of the line.
  const auto next_word = [&] {
    std::string_view word = scanner.word();
    while (word == "\\" && scanner.next_line()) word = scanner.word();
    return word;
  };
  PolygonMesh mesh;
  // Faces may come before their vertices, so the largest index is checked at the end.
  std::int64_t largest = 0;
  std::size_t line_of_largest = 0;
  std::set<std::string> unread;
  while (scanner.next_line()) {
    const std::string_view keyword = next_word();
    if (keyword == "v") {
      Eigen::Vector3d position;
      for (int k = 0; k < 3; ++k) position[k] = scanner.real(next_word());
      if (!position.allFinite())
        mesh.line_of_nonfinite[static_cast<std::uint32_t>(mesh.vertices.size())] = scanner.line();
      mesh.vertices.push_back(position);
      if (mesh.vertices.size() > UINT32_MAX) scanner.fail("more than 2^32 vertices");
    } else if (keyword == "f") {
      const std::size_t begin = mesh.corners.size();
      const auto count = static_cast<std::int64_t>(mesh.vertices.size());
      for (std::string_view word = next_word(); !word.empty(); word = next_word()) {
        const std::int64_t given = vertex_of_corner(scanner, word);
        const std::int64_t index = given < 0 ? count + given : given - 1;
        if (given == 0) scanner.fail("vertex 0 does not exist: OBJ counts from 1");
        if (index < 0 || index >= UINT32_MAX)
          scanner.fail("vertex " + std::to_string(given) + " does not exist");
        if (index > largest || line_of_largest == 0) {
          largest = index;
          line_of_largest = scanner.line();
        }
        mesh.corners.push_back(static_cast<std::uint32_t>(index));
      }
      if (mesh.corners.size() - begin < 3) scanner.fail("a face needs three or more corners");
      mesh.ends.push_back(mesh.corners.size());
    } else if (is_surface(keyword)) {
      unread.emplace(keyword);
    }
  }
  for (const std::string& keyword : unread)
    mesh.notes.push_back("lines of " + in_quotes(keyword) +
                         (keyword == "call" ? " are not read: they name other files"
                                            : " are not read: free-form surfaces, not polygons"));
  if (line_of_largest > 0 && largest >= static_cast<std::int64_t>(mesh.vertices.size()))
    fail_at_line(file, line_of_largest,
                 "vertex " + std::to_string(largest + 1) + " does not exist: the file has " +
                     std::to_string(mesh.vertices.size()));
  return mesh;
}

}  // namespace ist
