/* The desk: memory for the arguments and answers of queries, at the addresses from places(). */
#pragma once

#include <ist/c.h>
#include <stddef.h>
#include <stdint.h>

#define EXPORT(name) __attribute__((export_name(#name)))

/* The maximum of a contact law's memory and of a GPU. */
enum { kMostPatches = sizeof((ist_contact_memory_t*)0)->patches / sizeof(ist_patch_memory_t) };

/* w, x, y, z; x, y, z; scale, where 0 means 1 */
typedef struct place {
  ist_pose_t pose;
  double scale;
} place_t;

typedef struct desk {
  place_t a, b;
  /* Used for separation too, which has fewer members. */
  ist_penetration_settings_t settings;
  ist_penetration_t penetration;
  ist_separation_t separation;
  ist_contact_patch_t patches[kMostPatches];
  ist_asset_info_t info;
  ist_bounds_t bounds;
  ist_mass_properties_t mass;
  uint32_t counts[2];
  ist_motion_t motion_a, motion_b;
  ist_impact_settings_t impact_settings;
  ist_impact_t impact;
  ist_size_match_t fit;
  ist_wrenches_t wrenches;
  double numbers[8]; /* of any query */
  ist_workspace_t workspace;
} desk_t;
extern desk_t desk;

_Static_assert(kMostPatches == 32, "patches");
_Static_assert(sizeof(ist_contact_patch_t) == 160, "patch");
_Static_assert(sizeof(ist_penetration_t) == 152, "penetration");
_Static_assert(sizeof(ist_ball_t) == 32, "ball");
_Static_assert(sizeof(ist_lens_t) == 72, "lens");
_Static_assert(sizeof(ist_outline_segment_t) == 56, "segment");

/* The address of an asset, or that of a shape plus 1. */
typedef uintptr_t solid_t;

static inline ist_placed_t placed(solid_t solid, const place_t* place) {
  const int is_field = solid % 2 == 1;
  const ist_placed_t made = {sizeof made, is_field ? NULL : (const ist_asset_t*)solid,
                             is_field ? (const ist_shape_t*)(solid - 1) : NULL, place->pose,
                             place->scale};
  return made;
}
