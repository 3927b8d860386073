#pragma once

#include <string>

#include <ist/solid.h>

namespace ist {

/// What mesh_level_set() makes, without a proof of how near it is to the level set, which would
/// take most of the time. Throws Error likewise.
ClosedMesh level_set_surface(const DistanceGrid& distances, const std::string& name);

}  // namespace ist
