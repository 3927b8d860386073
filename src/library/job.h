#pragma once

#include <string>

#include "settings/bake_settings.h"

namespace ist {

/// One asset to bake.
struct Job {
  std::string name;  ///< of the asset: NAME.ist
  std::string mesh;  ///< path
  BakeSettings settings;
};

}  // namespace ist
