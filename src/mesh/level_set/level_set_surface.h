#pragma once

#include <ist/solid.h>
#include <string>

namespace ist {

/// The mesh of mesh_level_set(), without the proof of its distance from the level set, which would
/// take most of the time. Throws Error likewise.
ClosedMesh level_set_surface(const DistanceGrid& distances, const std::string& name);

}  // namespace ist
