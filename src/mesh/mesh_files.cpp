#include "mesh/mesh_files.h"

#include <array>
#include <assimp/Importer.hpp>
#include <cctype>
#include <exception>
#include <filesystem>
#include <string_view>
#include <utility>

#include "mesh/import/gltf_document.h"

namespace ist {
namespace {

std::string ending_of(const std::string& path) {
  std::string ending = std::filesystem::path(path).extension().string();
  for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return ending;
}

bool is_ours(std::string_view ending) {
  constexpr std::array<std::string_view, 8> kOurs = {".obj", ".stl",  ".ply", ".off",
                                                     ".glb", ".gltf", ".dae", ".vdb"};
  for (const std::string_view one : kOurs)
    if (ending == one) return true;
  return false;
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
  } catch (const std::exception&) {  // loading it will say why
  }
  return files;
}

}  // namespace ist
