#include "app/mesh_notes.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <utility>

#include <ist/error.h>

namespace ist::app {

ClosedMesh close_or_advise(TriangleMesh mesh, const std::string& name,
                           const MeshSettings& settings) {
  try {
    return close_as_asked(std::move(mesh), name, settings);
  } catch (const OpenMeshError& error) {
    throw OpenMeshError(std::string(error.what()) +
                        (settings.repair ? "; --wrap 0.5% encloses it in a closed surface"
                                         : "; --repair tries to close it"));
  }
}

InputMesh read_mesh_aloud(const std::string& path, const MeshSettings& settings) {
  TriangleMesh mesh = load_mesh(path);
  place(mesh, settings);
  const DeclaredFrame declared = mesh.declared;
  ClosedMesh closed = close_or_advise(std::move(mesh), path, settings);
  for (const std::string& note : closed.report.notes) spdlog::warn("{}: {}", path, note);
  return {declared, std::move(closed)};
}

std::string describe_closing(const MeshReport& report) {
  if (!report.judged) return "";
  return fmt::format("{}, confidence {:.2f}", report.wrapped ? "wrap" : "repair",
                     report.judged->confidence);
}

nlohmann::ordered_json closing_json(const MeshReport& report) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (const char* name : {"method", "confidence", "agreement", "agreement_error", "kept_surface",
                           "volume_ratio", "input_mean", "input_max", "made_mean", "made_max"})
    json[name] = nullptr;
  if (!report.judged) return json;
  const Judgement& judged = *report.judged;
  json["method"] = report.wrapped ? "wrap" : "repair";
  json["confidence"] = judged.confidence;
  json["agreement"] = judged.agreement;
  json["agreement_error"] = judged.agreement_error;
  json["kept_surface"] = judged.kept_surface;
  json["volume_ratio"] = judged.volume_ratio;
  json["input_mean"] = judged.input_mean;
  json["input_max"] = judged.input_max;
  json["made_mean"] = judged.made_mean;
  json["made_max"] = judged.made_max;
  return json;
}

std::string describe_declared(const DeclaredFrame& declared) {
  std::string text;
  if (declared.up_axis != 0) text = fmt::format("{} up: axes are not converted", declared.up_axis);
  if (declared.unit != 0)
    text += fmt::format("{}1 unit = {:g} m{}", text.empty() ? "" : "; ", declared.unit,
                        declared.unit == 1 ? "" : ": lengths are converted to metres");
  return text;
}

nlohmann::ordered_json declared_json(const DeclaredFrame& declared) {
  nlohmann::ordered_json json = {{"up_axis", nullptr}, {"unit", nullptr}};
  if (declared.up_axis != 0) json["up_axis"] = std::string(1, declared.up_axis);
  if (declared.unit != 0) json["unit"] = declared.unit;
  return json;
}

}  // namespace ist::app
