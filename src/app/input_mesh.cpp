#include "app/input_mesh.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <utility>

#include <ist/error.h>

namespace ist::app {

InputMesh read_input_mesh(const std::string& path, bool repair) {
  TriangleMesh mesh = load_mesh(path);
  InputMesh result{mesh.declared, {}};
  try {
    result.closed =
        close_mesh(std::move(mesh), path, repair ? OpenMeshPolicy::repair : OpenMeshPolicy::refuse);
  } catch (const OpenMeshError& error) {
    if (repair) throw;
    throw OpenMeshError(std::string(error.what()) + "; --repair closes what can be closed");
  }
  for (const std::string& note : result.closed.report.notes) spdlog::warn("{}: {}", path, note);
  return result;
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
