#include "app/mesh_notes.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <utility>

#include <ist/error.h>

namespace ist::app {

ClosedMesh close_aloud(TriangleMesh mesh, const std::string& name, bool repair) {
  try {
    ClosedMesh closed =
        close_mesh(std::move(mesh), name, repair ? OpenMeshPolicy::repair : OpenMeshPolicy::refuse);
    for (const std::string& note : closed.report.notes) spdlog::warn("{}: {}", name, note);
    return closed;
  } catch (const OpenMeshError& error) {
    if (repair) throw;
    throw OpenMeshError(std::string(error.what()) + "; --repair closes what can be closed");
  }
}

InputMesh read_mesh_aloud(const std::string& path, const MeshSettings& settings) {
  TriangleMesh mesh = load_mesh(path);
  place(mesh, settings);
  const DeclaredFrame declared = mesh.declared;
  return {declared, close_aloud(std::move(mesh), path, settings.repair)};
}

std::string describe_declared(const DeclaredFrame& declared) {
  std::string text;
  if (declared.up_axis != 0)
    text = fmt::format("{} up: the file's axes are kept", declared.up_axis);
  if (declared.unit != 0)
    text += fmt::format("{}1 unit = {:g} m{}", text.empty() ? "" : "; ", declared.unit,
                        declared.unit == 1 ? "" : ": lengths come out in metres");
  return text;
}

nlohmann::ordered_json declared_json(const DeclaredFrame& declared) {
  nlohmann::ordered_json json = {{"up_axis", nullptr}, {"unit", nullptr}};
  if (declared.up_axis != 0) json["up_axis"] = std::string(1, declared.up_axis);
  if (declared.unit != 0) json["unit"] = declared.unit;
  return json;
}

}  // namespace ist::app
