
#include <fmt/format.h>
#include <ist/types.h>
#include <iterator>
#include <utility>

#include "app/options.h"
#include "bake/asset/atomic_file.h"

namespace ist::app {
namespace {

void append_vertices(std::string& out, const TriangleMesh& mesh, const char* prefix) {
  for (const Eigen::Vector3d& v : mesh.vertices)
    fmt::format_to(std::back_inserter(out), "{}{:.17g} {:.17g} {:.17g}\n", prefix, v.x(), v.y(),
                   v.z());
}

void append_triangles(std::string& out, const TriangleMesh& mesh, const char* prefix,
                      std::uint32_t first_index) {
  for (const auto& [a, b, c] : mesh.triangles)
    fmt::format_to(std::back_inserter(out), "{}{} {} {}\n", prefix, a + first_index,
                   b + first_index, c + first_index);
}

std::string obj(const TriangleMesh& mesh) {
  std::string out;
  append_vertices(out, mesh, "v ");
  append_triangles(out, mesh, "f ", 1);
  return out;
}

std::string off(const TriangleMesh& mesh) {
  std::string out = fmt::format("OFF\n{} {} 0\n", mesh.vertices.size(), mesh.triangles.size());
  append_vertices(out, mesh, "");
  append_triangles(out, mesh, "3 ", 0);
  return out;
}

std::string ply(const TriangleMesh& mesh) {
  std::string out = fmt::format(
      "ply\nformat ascii 1.0\n"
      "element vertex {}\nproperty double x\nproperty double y\nproperty double z\n"
      "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
      mesh.vertices.size(), mesh.triangles.size());
  append_vertices(out, mesh, "");
  append_triangles(out, mesh, "3 ", 0);
  return out;
}

std::string stl(const TriangleMesh& mesh) {
  std::string out(80, ' ');  // the header is free text
  const auto append = [&](const auto& value) {
    out.append(reinterpret_cast<const char*>(&value), sizeof(value));
  };
  append(static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const auto& triangle : mesh.triangles) {
    const Eigen::Vector3d& a = mesh.vertices[triangle[0]];
    const Eigen::Vector3d& b = mesh.vertices[triangle[1]];
    const Eigen::Vector3d& c = mesh.vertices[triangle[2]];
    const Eigen::Vector3d normal = (b - a).cross(c - a).normalized();
    for (const Eigen::Vector3d& v : {normal, a, b, c})
      for (const double x : v) append(static_cast<float>(x));
    append(std::uint16_t{0});
  }
  return out;
}

using Writer = std::string (*)(const TriangleMesh&);

Writer writer_of(const std::string& path) {
  constexpr std::pair<std::string_view, Writer> kWriters[] = {
      {".obj", obj}, {".off", off}, {".ply", ply}, {".stl", stl}};
  for (const auto& [ending, writer] : kWriters)
    if (ending == ending_of(path)) return writer;
  return nullptr;
}

}  // namespace

bool has_mesh_ending(const std::string& path) { return writer_of(path) != nullptr; }

void write_mesh(const TriangleMesh& mesh, const std::string& path) {
  const Writer writer = writer_of(path);
  if (writer == nullptr)
    throw Error(path + ": unknown mesh format '" + ending_of(path) +
                "'; use .obj, .ply, .off or .stl");
  write_atomically(path, writer(mesh));
}

}  // namespace ist::app
