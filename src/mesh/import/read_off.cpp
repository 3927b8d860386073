
#include "mesh/import/polygon_mesh.h"
#include "mesh/import/text_scanner.h"

namespace ist {
namespace {

/// Counts the lines from here to the end that contain more than a comment.
std::size_t count_lines_with_words(TextScanner scanner) {
  std::size_t count = 0;
  while (scanner.next_line()) count += scanner.word().empty() ? 0 : 1;
  return count;
}

std::size_t read_count(TextScanner& scanner, const char* of_what, std::size_t least_bytes) {
  const std::int64_t count = scanner.integer(scanner.word_anywhere());
  if (count < 0) scanner.fail(std::string("a negative number of ") + of_what);
  if (static_cast<std::uint64_t>(count) > scanner.bytes_left() / least_bytes + 1)
    scanner.fail("the file ends early: it is too short for " + std::to_string(count) + " " +
                 of_what);
  return static_cast<std::size_t>(count);
}

}  // namespace

/// Object File Format in text: OFF and its variants with normals, colours and texture coordinates.
PolygonMesh read_off(const SourceFile& file) {
  TextScanner scanner(file, '#');
  const std::string_view keyword = scanner.word_anywhere();
  if (keyword.size() < 3 || keyword.substr(keyword.size() - 3) != "OFF" ||
      keyword.find_first_not_of("STCNOF") != std::string_view::npos)
    fail(file, "does not begin with OFF (or COFF, NOFF, …, three-dimensional): it begins with " +
                   in_quotes(keyword));
  TextScanner ahead = scanner;
  if (ahead.word() == "BINARY") scanner.fail("binary OFF is not supported. Save it as text");

  const std::size_t vertex_count = read_count(scanner, "vertices", 6);  // "0 0 0\n"
  const std::size_t face_count = read_count(scanner, "faces", 4);       // "1 0\n"
  scanner.word();                                                       // edges, often 0 or missing
  // One line a record: colours and the like may follow the coordinates or the corners. Files with
  // other line breaks cannot have such extras.
  const bool line_a_record = count_lines_with_words(scanner) >= vertex_count + face_count;

  PolygonMesh mesh;
  mesh.vertices.reserve(vertex_count);
  mesh.ends.reserve(face_count);
  const auto first_word = [&](const char* of_what, std::size_t index, std::size_t count) {
    if (line_a_record) scanner.next_line();
    const std::string_view word = scanner.word_anywhere();
    if (word.empty())
      scanner.fail("the file ends early: " + std::string(of_what) + " " + std::to_string(index) +
                   " of " + std::to_string(count) + " is missing");
    return word;
  };
  const auto next_word = [&] { return line_a_record ? scanner.word() : scanner.word_anywhere(); };

  for (std::size_t i = 0; i < vertex_count; ++i) {
    Eigen::Vector3d position;
    position[0] = scanner.real(first_word("vertex", i, vertex_count));
    for (int k = 1; k < 3; ++k) position[k] = scanner.real(next_word());
    if (!position.allFinite())
      mesh.line_of_nonfinite[static_cast<std::uint32_t>(i)] = scanner.line();
    mesh.vertices.push_back(position);
  }
  for (std::size_t i = 0; i < face_count; ++i) {
    const std::int64_t corners = scanner.integer(first_word("face", i, face_count));
    if (corners < 1) scanner.fail("a face of " + std::to_string(corners) + " corners");
    for (std::int64_t k = 0; k < corners; ++k) {
      const std::string_view word = next_word();
      if (word.empty())
        scanner.fail((scanner.bytes_left() == 0 ? "the file ends early: face " : "face ") +
                     std::to_string(i) + " has fewer than the " + std::to_string(corners) +
                     " corners it announces");
      const std::int64_t index = scanner.integer(word);
      if (index < 0 || static_cast<std::uint64_t>(index) >= vertex_count)
        scanner.fail("face " + std::to_string(i) + ": vertex " + std::to_string(index) +
                     " does not exist: the file has " + std::to_string(vertex_count) +
                     ", counted from 0");
      mesh.corners.push_back(static_cast<std::uint32_t>(index));
    }
    if (corners < 3) mesh.corners.resize(mesh.corners.size() - static_cast<std::size_t>(corners));
    if (corners >= 3) mesh.ends.push_back(mesh.corners.size());
  }
  return mesh;
}

}  // namespace ist
