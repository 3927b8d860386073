#pragma once

// All of ist in C++ but batches on GPUs (gpu_query.h), TBB's pool (query_tbb.h), covers of robots'
// links (cover_spheres.h), the layout of assets (asset_layout.h) and Bullet (bullet/). In C it is
// c.h.

#include <ist/asset.h>
#if __has_include(<ist/bake.h>)  // of ist::ist; where ist::query alone is installed there is none
#include <ist/bake.h>
#include <ist/mesh.h>
#include <ist/solid.h>
#endif
#include <ist/contact_law.h>
#include <ist/deadline.h>
#include <ist/lenses.h>
#include <ist/mass_properties.h>
#include <ist/pose_eigen.h>
#include <ist/query.h>
#include <ist/raycast.h>
#include <ist/scene.h>
#include <ist/shapes.h>
#include <ist/time_of_impact.h>
#include <ist/types.h>
#include <ist/version.h>
