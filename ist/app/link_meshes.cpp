#include "app/link_meshes.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cctype>

#include <ist/error.h>

#include "app/mesh_notes.h"

namespace ist::app {
namespace {

std::string without_numbers(std::string text) {
  std::erase_if(text, [](char c) {
    return std::isdigit(static_cast<unsigned char>(c)) != 0 || c == '.' || c == ',' || c == '-';
  });
  return text;
}

}  // namespace

std::optional<ClosedMesh> LinkMeshes::close(const std::string& link,
                                            const std::function<TriangleMesh()>& make) {
  try {
    ClosedMesh closed =
        close_or_advise(make(), fmt::format("{}: link {}", robot_, link), settings_);
    for (const std::string& note : closed.report.notes) {
      Warning& warning = warnings_[without_numbers(note)];
      warning.differs |= !warning.links.empty() && note != warning.note;
      if (warning.links.empty() || note < warning.note) {
        warning.note = note;
        warning.link = link;
      }
      if (warning.links.empty() || warning.links.back() != link) warning.links.push_back(link);
    }
    return closed;
  } catch (const Error& error) {
    faults_.push_back(error.what());
    return std::nullopt;
  }
}

void LinkMeshes::finish() const {
  for (const auto& [kind, warning] : warnings_)
    spdlog::warn(
        "{}: {} {}: {}{}", robot_, warning.links.size() == 1 ? "link" : "links",
        fmt::join(warning.links, ", "), warning.note,
        warning.differs ? fmt::format(" (the numbers are those of {})", warning.link) : "");
  if (faults_.size() == 1) throw Error(faults_[0]);
  if (faults_.empty()) return;
  for (const std::string& fault : faults_) spdlog::error("{}", fault);
  throw Error(fmt::format("{}: {} links failed; nothing was written. --skip LINK leaves one out",
                          robot_, faults_.size()));
}

}  // namespace ist::app
