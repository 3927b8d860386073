#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <ist/mesh.h>

#include "library/settings/bake_settings.h"

namespace ist::app {

/// Closes the meshes of a robot's links, and says what was found once all have been looked at:
/// faults of each link, and warnings that differ in numbers alone in one line.
class LinkMeshes {
 public:
  LinkMeshes(std::string robot, MeshSettings settings)
      : robot_(std::move(robot)), settings_(settings) {}

  /// The mesh that `make` returns, closed; nothing where that or closing it throws Error.
  std::optional<ClosedMesh> close(const std::string& link,
                                  const std::function<TriangleMesh()>& make);

  /// Throws Error if any link failed.
  void finish() const;

 private:
  struct Warning {
    /// The first of its kind by its letters, so that of the lowest confidence, and whose it is.
    std::string note, link;
    std::vector<std::string> links;
    bool differs = false;  ///< the others' in its numbers
  };
  const std::string robot_;
  const MeshSettings settings_;
  std::vector<std::string> faults_;
  std::map<std::string, Warning> warnings_;
};

}  // namespace ist::app
