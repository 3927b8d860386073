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
AT(settings.pair_id, 148);
AT(settings.relative_error, 152);
AT(penetration.status, 164);
AT(penetration.volume, 168);
AT(penetration.node_visits, 264);
AT(separation.status, 276);
AT(separation.distance, 280);
AT(separation.node_visits, 376);
AT(patches, 384);
AT(info.has_field, 10628);
AT(info.volume, 10640);
AT(info.field_triangles, 10672);
AT(info.mesh_triangles, 10680);
AT(info.mesh_error, 10688);
AT(bounds.lower, 10712);
AT(mass.volume, 10800);
AT(counts, 10928);
AT(motion_a, 10936);
AT(motion_b, 11008);
AT(impact_settings.max_visits, 11084);
AT(impact_settings.duration, 11088);
AT(impact.kind, 11112);
AT(impact.time, 11128);
AT(fit.grain_a, 11232);
AT(fit.a_is_coarser, 11256);
AT(wrenches.on_a, 11280);
AT(numbers, 11376);
_Static_assert(sizeof(ist_contact_patch_t) == 160, "patch");
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
