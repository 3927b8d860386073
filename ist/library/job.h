#pragma once

#include <optional>
#include <string>

#include "library/settings/bake_settings.h"
#include "robots/description/robot_model.h"

namespace ist {

/// Requirements without which an asset fails. They do not change its bytes.
struct Demands {
  bool mesh = false;      ///< it contains its mesh, for exact queries
  double coverage = 0;    ///< at least; share of the solid's volume
  double confidence = 0;  ///< at least; of a mesh that had to be closed
};

/// One asset to bake.
struct Job {
  std::string name;                           ///< of the asset: NAME.ist
  std::string mesh;                           ///< path
  std::optional<PlacedLinkShape> shape = {};  ///< of a robot's link: that mesh in the link's frame
  std::string urdf = {};                      ///< the robot's, for messages
  BakeSettings settings;
  Demands demands;
};

}  // namespace ist
