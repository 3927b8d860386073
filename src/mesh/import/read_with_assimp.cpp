#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <algorithm>
#include <assimp/Importer.hpp>
#include <string_view>
#include <utility>

#include "mesh/import/polygon_mesh.h"

namespace ist {
namespace {

using AssimpTransform = Eigen::Matrix4d;

AssimpTransform to_double(const aiMatrix4x4& m) {
  AssimpTransform result;
  result << double(m.a1), double(m.a2), double(m.a3), double(m.a4),  //
      double(m.b1), double(m.b2), double(m.b3), double(m.b4),        //
      double(m.c1), double(m.c2), double(m.c3), double(m.c4),        //
      double(m.d1), double(m.d2), double(m.d3), double(m.d4);
  return result;
}

void append(const aiMesh& mesh, const AssimpTransform& world, PolygonMesh& out) {
  const auto first = out.vertices.size();
  if (mesh.HasBones())
    out.notes.emplace_back("a skin is not posed: its mesh is read as it was modelled");
  if (mesh.mNumAnimMeshes > 0)
    out.notes.emplace_back("morph targets are not applied: the base mesh is read");
  for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
    const aiVector3D& v = mesh.mVertices[i];
    out.vertices.push_back((world * Eigen::Vector4d(v.x, v.y, v.z, 1)).head<3>());
  }
  // A mirror turns every face inside out; this reverses it.
  const bool mirrored = world.topLeftCorner<3, 3>().determinant() < 0;
  for (unsigned i = 0; i < mesh.mNumFaces; ++i) {
    const aiFace& face = mesh.mFaces[i];
    if (face.mNumIndices < 3) continue;  // points and lines
    for (unsigned k = 0; k < face.mNumIndices; ++k) {
      const unsigned corner = face.mIndices[mirrored ? face.mNumIndices - 1 - k : k];
      out.corners.push_back(static_cast<std::uint32_t>(first + corner));
    }
    out.ends.push_back(out.corners.size());
  }
}

/// assimp rotates the z axis of these formats to y at the scene's root; this undoes it.
AssimpTransform own_axes(const std::string& ending) {
  constexpr std::array<std::string_view, 10> kTurned = {".3ds", ".prj", ".ase", ".ask",     ".dxf",
                                                        ".iqm", ".md2", ".md3", ".md5mesh", ".mdc"};
  AssimpTransform back = AssimpTransform::Identity();
  if (std::find(kTurned.begin(), kTurned.end(), ending) != kTurned.end())
    back << 1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1;
  return back;
}

/// FBX files declare the up axis and the centimetres of a unit. assimp reports both and converts
/// neither.
DeclaredFrame declared_frame(const aiScene& scene) {
  DeclaredFrame frame;
  if (scene.mMetaData == nullptr) return frame;
  std::int32_t up = -1;
  if (scene.mMetaData->Get("UpAxis", up) && up >= 0 && up <= 2) frame.up_axis = "XYZ"[up];
  float centimetres = 0;
  if (scene.mMetaData->Get("UnitScaleFactor", centimetres) && centimetres > 0)
    frame.unit = double(centimetres) / 100;
  return frame;
}

}  // namespace

PolygonMesh read_with_assimp(const SourceFile& file) {
  Assimp::Importer importer;
  const std::string ending = ending_of(file.path);
  if (ending == ".step" || ending == ".stp")  // assimp takes them for IFC files
    fail(file, "a STEP file has no triangles. Make a GLB of it, as cascadio does");
  if (ending.empty() || !importer.IsExtensionSupported(ending))
    fail(file, "no mesh format ends in " + in_quotes(ending) +
                   ". Known are obj, stl, ply, off, glb, gltf, dae and what assimp reads");
  // ValidateDataStructure: indices are then in range, whatever the file contains.
  const aiScene* const scene = importer.ReadFile(file.path, aiProcess_ValidateDataStructure);
  if (scene == nullptr || scene->mRootNode == nullptr)
    fail(file, "cannot be read as a mesh: " + std::string(importer.GetErrorString()));
  PolygonMesh mesh;
  mesh.declared = declared_frame(*scene);
  if ((scene->mFlags & AI_SCENE_FLAGS_INCOMPLETE) != 0)
    mesh.notes.emplace_back("assimp read only a part of the file");
  if (ending == ".3mf" || ending == ".amf")
    mesh.notes.emplace_back("the unit is not read: millimetres, unless the file names another");
  std::vector<std::pair<const aiNode*, AssimpTransform>> open{
      {scene->mRootNode, own_axes(ending) * to_double(scene->mRootNode->mTransformation)}};
  while (!open.empty()) {
    const auto [node, world] = open.back();
    open.pop_back();
    for (unsigned i = 0; i < node->mNumMeshes; ++i) {
      const aiMesh& one = *scene->mMeshes[node->mMeshes[i]];
      if (mesh.vertices.size() + one.mNumVertices > UINT32_MAX)
        fail(file, "more than 2^32 vertices. Split the mesh");
      append(one, world, mesh);
    }
    for (unsigned i = node->mNumChildren; i-- > 0;)
      open.emplace_back(node->mChildren[i], world * to_double(node->mChildren[i]->mTransformation));
  }
  return mesh;
}

}  // namespace ist
