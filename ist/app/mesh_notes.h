#pragma once

#include <ist/mesh.h>
#include <map>
#include <nlohmann/json.hpp>

#include "library/input_mesh.h"
#include "library/settings/bake_settings.h"

namespace ist::app {

/// Closes the meshes of a robot's links, and reports the results for all of them together: faults
/// of each link, and warnings that differ only in numbers in one line.
class LinkMeshes {
 public:
  /// `repaired`: links that are repaired whatever the settings.
  LinkMeshes(std::string robot, MeshSettings settings, std::vector<std::string> repaired)
      : robot_(std::move(robot)), settings_(settings), repaired_(std::move(repaired)) {}

  /// Returns a substitute for a mesh that cannot be closed, given the reason; nothing: an error.
  using Otherwise = std::function<std::optional<ClosedMesh>(const std::string& why)>;

  /// The mesh that `make` returns, closed; if both are requested, by the better of repair and wrap.
  /// Nothing if either throws Error, which is a fault of each of these links.
  std::optional<ClosedMesh> close(const std::vector<std::string>& links,
                                  const std::function<TriangleMesh()>& make,
                                  const Otherwise& otherwise = {});

  bool repairs(const std::vector<std::string>& links) const;

  /// Records a finding about a link, which finish() reports.
  void warn(const std::string& link, const std::string& note);

  /// Reports the findings since the last call. Throws Error if any link failed.
  void finish();

  const std::vector<std::string>& said() const { return said_; }

 private:
  struct Warning {
    /// The first of its kind alphabetically, i.e. of the lowest confidence, and its link.
    std::string note, link;
    std::vector<std::string> links;
    bool differs = false;  ///< other links' numbers differ
  };
  const std::string robot_;
  const MeshSettings settings_;
  const std::vector<std::string> repaired_;
  std::vector<std::string> faults_, said_;
  std::map<std::string, Warning> warnings_;
};

/// Warns which links of a robot are skipped because they have only visual shapes.
void warn_of_left_out(const std::vector<std::string>& links, const std::string& robot);

/// read_input_mesh(); notes about the mesh go to stderr as warnings. Throws Error.
InputMesh read_mesh_aloud(const std::string& path, const MeshSettings& settings);

/// How an open mesh was closed, and with what confidence; "" for a closed one.
std::string describe_closing(const MeshReport& report);

/// The same with all figures; nulls for a closed mesh.
nlohmann::ordered_json closing_json(const MeshReport& report);

/// Describes the axes and unit that a file declares and how they were used; "" if it declares none.
std::string describe_declared(const DeclaredFrame& declared);

/// The same; null for everything that it does not declare.
nlohmann::ordered_json declared_json(const DeclaredFrame& declared);

}  // namespace ist::app
