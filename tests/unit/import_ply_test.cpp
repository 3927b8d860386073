#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include <ist/mesh.h>
#include <ist/types.h>

#include "support/temp_file.h"

namespace ist {
namespace {

using testing::TempFile;

/// A binary PLY body, value by value.
class Bytes {
 public:
  explicit Bytes(bool big_endian) : big_endian_(big_endian) {}
  template <class T>
  Bytes& operator<<(const T value) {
    std::string raw(reinterpret_cast<const char*>(&value), sizeof value);
    if (big_endian_) std::reverse(raw.begin(), raw.end());
    text += raw;
    return *this;
  }
  std::string text;

 private:
  bool big_endian_;
};

constexpr double kPlyCorners[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
constexpr int kPlyFaces[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};

std::string header(const std::string& format, const std::string& vertex_type,
                   const std::string& index_type) {
  return "ply\nformat " + format + " 1.0\ncomment c\nobj_info o\nelement vertex 4\nproperty " +
         vertex_type + " x\nproperty uchar red\nproperty " + vertex_type + " y\nproperty " +
         vertex_type + " z\nelement face 4\nproperty list uchar " + index_type +
         " vertex_indices\nend_header\n";
}

template <class Vertex, class Index>
std::string binary(const bool big_endian, const std::string& vertex_type,
                   const std::string& index_type) {
  Bytes body(big_endian);
  for (const auto& c : kPlyCorners)
    body << static_cast<Vertex>(c[0]) << std::uint8_t{7} << static_cast<Vertex>(c[1])
         << static_cast<Vertex>(c[2]);
  for (const auto& f : kPlyFaces) {
    body << std::uint8_t{3};
    for (const int v : f) body << static_cast<Index>(v);
  }
  return header(big_endian ? "binary_big_endian" : "binary_little_endian", vertex_type,
                index_type) +
         body.text;
}

TriangleMesh load(const std::string& bytes) { return load_mesh(TempFile("a.ply", bytes).path()); }

void expect_tetrahedron(const std::string& bytes) {
  const TriangleMesh mesh = load(bytes);
  EXPECT_EQ(mesh.vertices.size(), 4u);
  EXPECT_NEAR(close_mesh(mesh, "tetrahedron").report.volume, 1.0 / 6, 1e-15);
}

std::string ply_error_of(const std::string& bytes) {
  try {
    load(bytes);
  } catch (const Error& error) {
    return error.what();
  }
  return "accepted";
}

TEST(ReadPly, EveryEncodingAndType) {
  for (const bool big_endian : {false, true}) {
    expect_tetrahedron(binary<float, std::int32_t>(big_endian, "float", "int"));
    expect_tetrahedron(binary<double, std::uint32_t>(big_endian, "float64", "uint32"));
    expect_tetrahedron(binary<std::int16_t, std::uint8_t>(big_endian, "short", "uint8"));
    expect_tetrahedron(binary<std::int8_t, std::uint16_t>(big_endian, "char", "ushort"));
  }
  expect_tetrahedron(header("ascii", "double", "int") +
                     "0 7 0 0\n1 7 0 0\n0 7 1 0\n0 7 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n");
}

TEST(ReadPly, LinesOfTheHeaderMayEndInCrLf) {
  std::string bytes = binary<float, std::int32_t>(false, "float", "int");
  const std::size_t end = bytes.find("end_header\n") + 10;
  std::string head = bytes.substr(0, end);
  for (std::size_t at = 0; (at = head.find('\n', at)) != std::string::npos; at += 2)
    head.replace(at, 1, "\r\n");
  expect_tetrahedron(head + "\r" + bytes.substr(end));
}

TEST(ReadPly, TextKeepsAllDigitsOfADouble) {
  EXPECT_EQ(load("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                 "property float z\nelement face 1\nproperty list uchar int vertex_index\n"
                 "end_header\n0.1 1000000.0000001234 0\n1 0 0\n0 1 0\n3 0 1 2\n")
                .vertices[0],
            Eigen::Vector3d(0.1, 1000000.0000001234, 0));
}

TEST(ReadPly, EveryCutIsAnError) {
  const std::string whole = binary<float, std::int32_t>(false, "float", "int");
  for (std::size_t length = 1; length < whole.size(); ++length)
    EXPECT_NE(ply_error_of(whole.substr(0, length)), "accepted") << length;
  EXPECT_NE(ply_error_of(whole.substr(0, whole.size() - 1)).find("ends early"), std::string::npos);
}

TEST(ReadPly, CountsAreCheckedBeforeMemoryIsTaken) {
  for (const std::string lie :
       {"2147483647", "18446744073709551615", "-1", "9223372036854775807"}) {
    std::string bytes = binary<float, std::int32_t>(false, "float", "int");
    bytes.replace(bytes.find("vertex 4"), 8, "vertex " + lie);
    EXPECT_NE(ply_error_of(bytes), "accepted") << lie;
  }
  EXPECT_NE(ply_error_of("ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty float x\n"
                         "property float y\nproperty float z\nend_header\n0 0 0\n")
                .find("too short"),
            std::string::npos);
}

// Elements without properties take no bytes, so that no length of file contradicts their number.
TEST(ReadPly, AnyNumberOfNothingIsNothing) {
  const std::string start =
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float "
      "z\n";
  for (const std::string name : {"face", "other"}) try {
      load_mesh(
          TempFile("a.ply", start + "element " + name + " 9000000000000000000\nend_header\n0 0 0\n")
              .path());
      FAIL();
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("a.ply: contains no faces"), std::string::npos)
          << error.what();
    }
}

TEST(ReadPly, IndicesAreChecked) {
  for (const std::int32_t bad : {-1, 4, 2147483647}) {
    std::string bytes = binary<float, std::int32_t>(false, "float", "int");
    bytes.replace(bytes.size() - 4, 4,
                  std::string(reinterpret_cast<const char*>(&bad), sizeof bad));
    EXPECT_NE(ply_error_of(bytes).find("face 3: corner 2 is not a vertex"), std::string::npos)
        << ply_error_of(bytes);
  }
}

TEST(ReadPly, NonFiniteVertexIsNamedOnlyIfUsed) {
  const std::string start =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
      "property float z\nelement face 1\nproperty list uchar int vertex_index\nend_header\n";
  EXPECT_EQ(load(start + "0 0 0\nnan 0 0\n1 0 0\n0 1 0\n3 0 2 3\n").vertices.size(), 3u);
  EXPECT_NE(
      ply_error_of(start + "0 0 0\nnan 0 0\n1 0 0\n0 1 0\n3 0 1 3\n").find("line 11: vertex 1"),
      std::string::npos);
}

}  // namespace
}  // namespace ist
