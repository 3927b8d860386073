#include "app/mesh_notes.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <ist/error.h>

namespace ist::app {

InputMesh read_mesh_aloud(const std::string& path, const MeshSettings& settings) {
  try {
    InputMesh mesh = read_input_mesh(path, settings);
    for (const std::string& note : mesh.closed.report.notes) spdlog::warn("{}: {}", path, note);
    return mesh;
  } catch (const OpenMeshError& error) {
    if (settings.repair) throw;
    throw OpenMeshError(std::string(error.what()) + "; --repair closes what can be closed");
  }
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
