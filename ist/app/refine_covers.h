#pragma once

#include <cstddef>
#include <map>
#include <string>

#include <ist/cover_spheres.h>
#include <ist/types.h>

#include "app/sphere_output.h"
#include "library/link_solids.h"

namespace ist::app {

/// Adds to a link's cover the spheres of its description and, for a repaired link, spheres that
/// contain the mesh as it was read (`read`).
void complete_cover(SphereLink& link, bool read);

/// Covers links again whose spheres overlap others' though the solids do not: with as many spheres
/// as it takes to protrude only into the gaps that the solids leave there, of which the tightest
/// are given up until 60 spheres a link on average are enough. Nothing is changed where at most a
/// tenth of the free poses are called colliding, or where that would not become fewer.
///
/// `robot.self` is of its covers, and stays so. `fixed`: counts of links by name, which are kept.
/// `is_open`: whether counts may change; if not, it is told alone what is in the way.
void refine_covers(SphereRobot& robot, SelfCollisionStudy& study, const LinkSolids& solids,
                   const SphereCoverSettings& cover,
                   const std::map<std::string, std::size_t>& fixed, bool is_open,
                   const ProgressCallback& progress);

}  // namespace ist::app
