/* The desk: numbers of questions and answers lie at fixed places of it, which src/desk.js knows. */
#pragma once

#include <ist/ist.h>
#include <stddef.h>
#include <stdint.h>

#define EXPORT(name) __attribute__((export_name(#name)))

enum { kMostPatches = 64 };

/* w, x, y, z; x, y, z; scale, where 0 is taken for 1 */
typedef struct place {
  ist_pose_t pose;
  double scale;
} place_t;

typedef struct desk {
  place_t a, b;
  /* For separation too, which has fewer. */
  ist_penetration_settings_t settings;
  ist_penetration_t penetration;
  ist_separation_t separation;
  ist_contact_patch_t patches[kMostPatches];
  ist_tree_info_t info;
  ist_bounds_t bounds;
  ist_mass_properties_t mass;
  uint32_t counts[2];
  ist_motion_t motion_a, motion_b;
  ist_impact_settings_t impact_settings;
  ist_impact_t impact;
  ist_pair_fit_t fit;
  ist_wrenches_t wrenches;
  double numbers[8]; /* of whatever is asked */
  ist_workspace_t workspace;
} desk_t;
extern desk_t desk;

#define AT(member, place) _Static_assert(offsetof(desk_t, member) == (place), #member)
AT(a, 0);
AT(b, 64);
AT(settings.measure, 132);
AT(settings.field, 136);
AT(settings.pair_budget, 140);
AT(settings.max_visits, 144);
AT(settings.relative_error, 152);
AT(penetration.status, 164);
AT(penetration.volume, 168);
AT(penetration.node_visits, 264);
AT(separation.status, 276);
AT(separation.distance, 280);
AT(separation.node_visits, 376);
AT(patches, 384);
AT(info.has_field, 8580);
AT(info.volume, 8592);
AT(info.field_triangles, 8624);
AT(info.mesh_triangles, 8632);
AT(info.mesh_error, 8640);
AT(bounds.lower, 8664);
AT(mass.volume, 8752);
AT(counts, 8880);
AT(motion_a, 8888);
AT(motion_b, 8960);
AT(impact_settings.max_visits, 9036);
AT(impact_settings.duration, 9040);
AT(impact.kind, 9064);
AT(impact.time, 9080);
AT(fit.grain_a, 9184);
AT(fit.a_is_coarser, 9208);
AT(wrenches.on_a, 9232);
AT(numbers, 9328);
_Static_assert(sizeof(ist_contact_patch_t) == 128, "patch");
_Static_assert(sizeof(ist_penetration_t) == 112, "penetration");
_Static_assert(sizeof(ist_ball_t) == 32, "ball");
_Static_assert(sizeof(ist_lens_t) == 72, "lens");
_Static_assert(sizeof(ist_outline_segment_t) == 56, "segment");

/* Where a tree lies, or a field, plus 1. */
typedef uintptr_t solid_t;

static inline ist_placed_t placed(solid_t solid, const place_t* place) {
  const int is_field = solid % 2 == 1;
  const ist_placed_t made = {sizeof made, is_field ? NULL : (const ist_tree_t*)solid,
                             is_field ? (const ist_field_t*)(solid - 1) : NULL, place->pose,
                             place->scale};
  return made;
}
