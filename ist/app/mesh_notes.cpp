#include "app/mesh_notes.h"

#include <fmt/format.h>
#include <ist/types.h>
#include <spdlog/spdlog.h>
#include <algorithm>
#include <cctype>
#include <utility>

namespace ist::app {
namespace {

std::string without_numbers(std::string text) {
  std::erase_if(text, [](char c) {
    return std::isdigit(static_cast<unsigned char>(c)) != 0 || c == '.' || c == ',' || c == '-';
  });
  return text;
}

/// close_as_asked(); if both are requested, the better of repair and wrap.
ClosedMesh close_better(TriangleMesh mesh, const std::string& name, const MeshSettings& settings) {
  if (!settings.repair || settings.wrap == 0)
    return close_as_asked(std::move(mesh), name, settings);
  ClosedMesh repaired = close_as_asked(mesh, name, settings);
  if (!repaired.report.judged || repaired.report.wrapped) return repaired;
  ClosedMesh wrapped = wrap_mesh(std::move(mesh), name, settings.wrap);
  const double by_repair = repaired.report.judged->confidence,
               by_wrap = wrapped.report.judged->confidence;
  if (by_repair >= by_wrap) return repaired;
  wrapped.report.notes.insert(
      wrapped.report.notes.begin(),
      fmt::format("wrapped with confidence {:.2f}; repair had {:.2f}", by_wrap, by_repair));
  return wrapped;
}

}  // namespace

bool LinkMeshes::repairs(const std::vector<std::string>& links) const {
  return settings_.repair || std::any_of(links.begin(), links.end(), [&](const std::string& link) {
           return std::count(repaired_.begin(), repaired_.end(), link) != 0;
         });
}

std::optional<ClosedMesh> LinkMeshes::close(const std::vector<std::string>& links,
                                            const std::function<TriangleMesh()>& make,
                                            const Otherwise& otherwise) {
  MeshSettings settings = settings_;
  settings.repair = repairs(links);
  for (const std::string& name : links) {
    try {
      const std::string whose = fmt::format("{}: link {}", robot_, name);
      TriangleMesh mesh = make();
      ClosedMesh closed = [&] {
        try {
          return close_better(std::move(mesh), whose, settings);
        } catch (const OpenMeshError& error) {
          if (otherwise)
            if (auto other = otherwise(error.what())) return std::move(*other);
          throw;
        }
      }();
      for (const std::string& link : links)
        for (const std::string& note : closed.report.notes) warn(link, note);
      return closed;
    } catch (const Error& error) {
      faults_.push_back(error.what());
    }
  }
  return std::nullopt;
}

void LinkMeshes::warn(const std::string& link, const std::string& note) {
  Warning& warning = warnings_[without_numbers(note)];
  warning.differs |= !warning.links.empty() && note != warning.note;
  if (warning.links.empty() || note < warning.note) {
    warning.note = note;
    warning.link = link;
  }
  if (warning.links.empty() || warning.links.back() != link) warning.links.push_back(link);
}

void LinkMeshes::finish() {
  for (const auto& [kind, warning] : warnings_) {
    said_.push_back(fmt::format(
        "{} {}: {}{}", warning.links.size() == 1 ? "link" : "links", fmt::join(warning.links, ", "),
        warning.note,
        warning.differs ? fmt::format(" (the numbers are those of {})", warning.link) : ""));
    spdlog::warn("{}: {}", robot_, said_.back());
  }
  warnings_.clear();
  if (faults_.size() == 1) throw Error(faults_[0]);
  if (faults_.empty()) return;
  for (const std::string& fault : faults_) spdlog::error("{}", fault);
  throw Error(fmt::format(
      "{}: {} links failed; nothing was written. --repair-link LINK repairs one, --skip "
      "LINK leaves one out",
      robot_, faults_.size()));
}

void warn_of_left_out(const std::vector<std::string>& links, const std::string& robot) {
  if (!links.empty())
    spdlog::warn("{}: left out, because they have visual shapes alone: {}; --visual uses these",
                 robot, fmt::join(links, ", "));
}

InputMesh read_mesh_aloud(const std::string& path, const MeshSettings& settings) {
  InputMesh mesh = read_input_mesh(path, settings);
  for (const std::string& note : mesh.closed.report.notes) spdlog::warn("{}: {}", path, note);
  return mesh;
}

std::string describe_closing(const MeshReport& report) {
  if (!report.judged) return "";
  return fmt::format("{}, confidence {:.2f}", report.wrapped ? "wrap" : "repair",
                     report.judged->confidence);
}

nlohmann::ordered_json closing_json(const MeshReport& report) {
  using Quality = RepairQuality;
  constexpr std::pair<const char*, double Quality::*> kNumbers[] = {
      {"confidence", &Quality::confidence},
      {"agreement", &Quality::agreement},
      {"agreement_error", &Quality::agreement_error},
      {"kept_surface", &Quality::kept_surface},
      {"volume_ratio", &Quality::volume_ratio},
      {"input_mean", &Quality::input_mean},
      {"input_max", &Quality::input_max},
      {"made_mean", &Quality::made_mean},
      {"made_max", &Quality::made_max}};
  nlohmann::ordered_json json = {{"method", nullptr}};
  if (report.judged) json["method"] = report.wrapped ? "wrap" : "repair";
  for (const auto& [name, number] : kNumbers) {
    json[name] = nullptr;
    if (report.judged) json[name] = (*report.judged).*number;
  }
  return json;
}

std::string describe_declared(const DeclaredFrame& declared) {
  std::string text;
  if (declared.up_axis != 0) text = fmt::format("{} up: axes are not converted", declared.up_axis);
  if (declared.unit != 0)
    text += fmt::format("{}1 unit = {:g} m{}", text.empty() ? "" : "; ", declared.unit,
                        declared.converted   ? ": lengths are converted to metres"
                        : declared.unit == 1 ? ""
                                             : ": lengths are not converted");
  return text;
}

nlohmann::ordered_json declared_json(const DeclaredFrame& declared) {
  nlohmann::ordered_json json = {{"up_axis", nullptr}, {"unit", nullptr}};
  if (declared.up_axis != 0) json["up_axis"] = std::string(1, declared.up_axis);
  if (declared.unit != 0) json["unit"] = declared.unit;
  return json;
}

}  // namespace ist::app
