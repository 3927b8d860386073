#include <ist/mesh.h>
#include <ist/solid.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>
#include <algorithm>
#include <assimp/Importer.hpp>
#include <exception>
#include <set>
#include <span>
#include <utility>

#include "base/message_text.h"
#include "mesh/connectivity/weld.h"
#include "mesh/import/gltf_document.h"
#include "mesh/import/polygon_mesh.h"
#include "mesh/mesh_files.h"

namespace ist {

namespace {

using Reader = PolygonMesh (*)(const SourceFile&);

constexpr std::array<std::pair<std::string_view, Reader>, 7> kReaders{{
    {".obj", read_obj},
    {".stl", read_stl},
    {".ply", read_ply},
    {".off", read_off},
    {".glb", read_gltf},
    {".gltf", read_gltf},
    {".dae", read_collada},
}};

Reader reader_of(const std::string& path) {
  const std::string ending = ending_of(path);
  for (const auto& [known, reader] : kReaders)
    if (ending == known) return reader;
  return read_with_assimp;
}

/// Bounds of the referenced vertices. Throws if one of them is infinite or not a number.
Eigen::AlignedBox3d finite_bounds(const SourceFile& file, const PolygonMesh& mesh) {
  struct Bounds {
    Eigen::AlignedBox3d box;
    bool finite = true;
  };
  const std::span<const std::uint32_t> corners =
      mesh.triangles.empty() ? std::span(mesh.corners)
                             : std::span(mesh.triangles[0].data(), 3 * mesh.triangles.size());
  const Bounds bounds = tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, corners.size()), Bounds(),
      [&](const tbb::blocked_range<std::size_t>& range, Bounds of_range) {
        for (std::size_t i = range.begin(); i < range.end() && of_range.finite; ++i) {
          const Eigen::Vector3d& x = mesh.vertices[corners[i]];
          of_range.finite = x.allFinite();
          if (of_range.finite) of_range.box.extend(x);
        }
        return of_range;
      },
      [](const Bounds& a, const Bounds& b) {
        return Bounds{a.box.merged(b.box), a.finite && b.finite};
      });
  if (bounds.finite) return bounds.box;
  for (const std::uint32_t v : corners) {
    if (mesh.vertices[v].allFinite()) continue;
    const auto found = mesh.line_of_nonfinite.find(v);
    const std::string line =
        found == mesh.line_of_nonfinite.end() ? "" : "line " + std::to_string(found->second) + ": ";
    fail(file, line + "vertex " + std::to_string(v) +
                   " (counted from 0) has a coordinate that is infinite or not a number. "
                   "Correct it, or remove the faces that use it");
  }
  return bounds.box;
}

TriangleMesh mesh_of(const SourceFile& file, PolygonMesh polygons, const ImportSettings& settings) {
  if (polygons.ends.empty() && polygons.triangles.empty())
    fail(file, "contains no faces, so it does not bound a solid");
  const Eigen::AlignedBox3d bounds = finite_bounds(file, polygons);
  std::vector<std::array<std::uint32_t, 3>> triangles = triangulate(polygons);
  TriangleMesh mesh{std::move(polygons.vertices), std::move(triangles)};
  mesh = weld(std::move(mesh), settings.weld_tolerance * bounds.diagonal().norm());
  mesh.declared = polygons.declared;
  std::set<std::string> said;  // many meshes of a scene may share a note
  for (std::string& note : polygons.notes)
    if (said.insert(note).second) mesh.notes.push_back(std::move(note));
  return mesh;
}

/// True if this library reads the format itself.
bool is_ours(const std::string& ending) {
  return ending == ".vdb" || std::any_of(kReaders.begin(), kReaders.end(),
                                         [&](const auto& one) { return ending == one.first; });
}

}  // namespace

bool is_mesh_format(const std::string& path) {
  const std::string ending = ending_of(path);
  if (ending.empty()) return false;
  return is_ours(ending) || Assimp::Importer().IsExtensionSupported(ending);
}

std::optional<std::vector<std::string>> files_of_mesh(const std::string& path) {
  const std::string ending = ending_of(path);
  if (!is_ours(ending)) return std::nullopt;
  std::vector<std::string> files = {path};
  if (ending != ".gltf" && ending != ".glb") return files;
  const SourceFile source = read_source_file(path);
  try {
    for (std::string& beside : GltfDocument(source).files()) files.push_back(std::move(beside));
  } catch (const std::exception&) {  // loading it will report why
  }
  return files;
}

TriangleMesh load_mesh(const std::string& path, const ImportSettings& settings) {
  if (!(settings.weld_tolerance >= 0) || settings.weld_tolerance > 0.1)
    throw Error(path + ": the weld tolerance must be 0 to 0.1 of the diagonal");
  if (ending_of(path) == ".vdb") {
    ClosedMesh level_set = load_vdb(path).mesh;
    return weld(std::move(level_set.mesh),
                settings.weld_tolerance * level_set.report.bounds.diagonal().norm());
  }
  return read_mesh(read_source_file(path), settings);
}

TriangleMesh read_mesh(const SourceFile& file, const ImportSettings& settings) {
  refuse_other_content(file);
  if (ending_of(file.path) != ".stl") refuse_other_format(file);  // its header may be any text
  return mesh_of(file, reader_of(file.path)(file), settings);
}

MeshScene read_mesh_scene(const std::string& path) {
  const SourceFile file = read_source_file(path);
  refuse_other_content(file);
  refuse_other_format(file);
  GltfParts read = read_gltf_parts(file);
  MeshScene scene;
  for (PolygonMesh& mesh : read.meshes) {
    const bool empty = mesh.ends.empty();  // lines or points alone
    scene.meshes.push_back(empty ? TriangleMesh{} : mesh_of(file, std::move(mesh), {}));
  }
  for (GltfParts::Part& part : read.parts)
    scene.parts.push_back({std::move(part.name), part.mesh, part.in_world});
  scene.notes = std::move(read.notes);
  scene.of_doubles = read.of_doubles;
  return scene;
}

void scale_mesh(TriangleMesh& mesh, const Eigen::Vector3d& factors) {
  if (!factors.allFinite() || (factors.array() == 0).any())
    throw Error("scale: " + position_text(factors) + " makes no solid; factors are finite, not 0");
  if (factors == Eigen::Vector3d::Ones()) return;
  for (Eigen::Vector3d& v : mesh.vertices) v = v.cwiseProduct(factors);
  if ((factors.array() < 0).count() % 2 != 0)  // a mirror shows triangles from behind
    for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
}

}  // namespace ist
