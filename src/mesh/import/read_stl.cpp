#include <tbb/parallel_for.h>
#include <bit>
#include <cctype>
#include <cstring>

#include "base/message_text.h"
#include "mesh/import/polygon_mesh.h"
#include "mesh/import/text_scanner.h"

namespace ist {
namespace {

constexpr std::size_t kHeaderBytes = 84;  // 80 of free text, then the count
constexpr std::size_t kFacetBytes = 50;   // normal, three corners, 2 bytes of attributes

std::uint64_t triangles_announced(const SourceFile& file) {
  std::uint32_t count = 0;
  std::memcpy(&count, file.bytes.data() + kHeaderBytes - 4, sizeof count);
  return count;
}

/// True if the count in a binary file's header matches its size.
bool has_binary_size(const SourceFile& file) {
  return file.bytes.size() >= kHeaderBytes &&
         kHeaderBytes + kFacetBytes * triangles_announced(file) == file.bytes.size();
}

PolygonMesh read_binary(const SourceFile& file) {
  if (!has_binary_size(file)) refuse_other_format(file);
  if (file.bytes.find('\0') == std::string::npos)
    fail(file,
         "is text, and no STL: that begins with \"solid\", not with " +
             in_quotes(std::string_view(file.bytes).substr(0, file.bytes.find_first_of("\r\n"))));
  if (file.bytes.size() < kHeaderBytes)
    fail(file, "the file ends early: binary STL begins with " + std::to_string(kHeaderBytes) +
                   " bytes, here are " + std::to_string(file.bytes.size()));
  const std::uint64_t count = triangles_announced(file);
  const std::uint64_t needed = kHeaderBytes + kFacetBytes * count;
  if (needed > file.bytes.size())
    fail(file, "the file ends early, or is no STL: as a binary one, its " + std::to_string(count) +
                   " triangles need " + std::to_string(needed) + " bytes, here are " +
                   std::to_string(file.bytes.size()));
  PolygonMesh mesh;
  if (file.bytes.size() >= needed + kFacetBytes)
    mesh.notes.push_back(std::to_string(file.bytes.size() - needed) + " bytes behind the " +
                         counted(count, "triangle") + " that the header announces are not read");
  mesh.vertices.resize(3 * count);
  mesh.triangles.resize(count);
  tbb::parallel_for(std::uint64_t{0}, count, [&](std::uint64_t i) {
    float corners[9];
    std::memcpy(corners, file.bytes.data() + kHeaderBytes + kFacetBytes * i + 12, sizeof corners);
    const auto first = static_cast<std::uint32_t>(3 * i);
    mesh.triangles[i] = {first, first + 1, first + 2};
    for (std::size_t k = 0; k < 3; ++k)
      mesh.vertices[first + k] = {corners[3 * k], corners[3 * k + 1], corners[3 * k + 2]};
  });
  return mesh;
}

bool same_letters(std::string_view word, std::string_view lower) {
  if (word.size() != lower.size()) return false;
  for (std::size_t i = 0; i < word.size(); ++i)
    if (std::tolower(static_cast<unsigned char>(word[i])) != lower[i]) return false;
  return true;
}

PolygonMesh read_text(const SourceFile& file) {
  TextScanner scanner(file, 0);
  const auto next = [&] {
    const std::string_view word = scanner.word_anywhere();
    if (word.empty()) scanner.fail("the file ends early: a solid is not closed by endsolid");
    return word;
  };
  const auto expect = [&](std::string_view word, const char* keyword) {
    if (same_letters(word, keyword)) return;
    if (scanner.bytes_left() == 0) scanner.fail("the file ends early, in " + in_quotes(word));
    scanner.fail("expected " + in_quotes(keyword) + ", found " + in_quotes(word));
  };
  PolygonMesh mesh;
  for (std::string_view word = scanner.word_anywhere(); !word.empty();
       word = scanner.word_anywhere()) {
    expect(word, "solid");
    while (!scanner.word().empty()) {
    }  // its name
    for (word = next(); !same_letters(word, "endsolid"); word = next()) {
      expect(word, "facet");
      expect(next(), "normal");
      for (int k = 0; k < 3; ++k) next();  // the normal is implied by the corners, and often wrong
      expect(next(), "outer");
      expect(next(), "loop");
      const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
      for (int corner = 0; corner < 3; ++corner) {
        expect(next(), "vertex");
        Eigen::Vector3d position;
        for (int k = 0; k < 3; ++k) position[k] = scanner.real(next());
        if (!position.allFinite())
          mesh.line_of_nonfinite[static_cast<std::uint32_t>(mesh.vertices.size())] = scanner.line();
        mesh.vertices.push_back(position);
      }
      expect(next(), "endloop");
      expect(next(), "endfacet");
      mesh.add_triangle(first, first + 1, first + 2);
    }
    while (!scanner.word().empty()) {
    }
  }
  return mesh;
}

bool is_text(const SourceFile& file) {
  if (has_binary_size(file)) return false;  // many binary files begin with "solid" too
  const std::string_view bytes = without_byte_order_mark(file.bytes);
  const std::size_t first = bytes.find_first_not_of(" \t\r\n");
  return first != std::string_view::npos && same_letters(bytes.substr(first, 5), "solid") &&
         bytes.find('\0') == std::string_view::npos;
}

}  // namespace

PolygonMesh read_stl(const SourceFile& file) {
  static_assert(std::endian::native == std::endian::little);
  // 3 corners a triangle must stay countable in 32 bits.
  if (file.bytes.size() / kFacetBytes > UINT32_MAX / 3)
    fail(file, "more than 2^32 corners. Split the mesh");
  return is_text(file) ? read_text(file) : read_binary(file);
}

}  // namespace ist
