/* Protrusion, fit, wrenches, rays, points, motions and batches for JavaScript. */
#include "desk.h"

/* --- Of answers that lie on the desk ---------------------------------------------------------- */

EXPORT(without_protrusion)
ist_status_t without_protrusion(solid_t a, solid_t b) {
  const ist_placed_t first = placed(a, &desk.a), second = placed(b, &desk.b);
  return ist_without_protrusion(&desk.penetration, &first, &second, &desk.penetration);
}

EXPORT(patches_without_protrusion)
ist_status_t patches_without_protrusion(solid_t a, solid_t b, uint32_t count) {
  const ist_placed_t first = placed(a, &desk.a), second = placed(b, &desk.b);
  ist_contact_patches_t found = {sizeof found, sizeof desk.patches[0], desk.patches, count, count};
  return ist_patches_without_protrusion(&first, &second, &desk.settings, &found);
}

EXPORT(size_match) ist_status_t size_match(solid_t a, solid_t b) {
  const ist_placed_t first = placed(a, &desk.a), second = placed(b, &desk.b);
  return ist_get_size_match(&first, &second, &desk.fit);
}

/* For the penetration or, if `is_patch`, the first patch; points are in `numbers`. */
EXPORT(wrenches) ist_status_t wrenches(int32_t is_patch) {
  const double *const of_a = desk.numbers, *const of_b = desk.numbers + 3;
  return is_patch ? ist_patch_wrenches(&desk.patches[0], &desk.b.pose, of_a, of_b, &desk.wrenches)
                  : ist_wrenches(&desk.penetration, &desk.b.pose, of_a, of_b, &desk.wrenches);
}

/* --- Rays and points: of a solid at place A --------------------------------------------------- */

EXPORT(raycast)
ist_status_t raycast(solid_t solid, const ist_ray_t* rays, size_t count, ist_ray_hit_t* hits) {
  const ist_placed_t at = placed(solid, &desk.a);
  return ist_raycast(&at, rays, count, hits, sizeof *hits);
}
EXPORT(closest_point)
ist_status_t closest_point(solid_t solid, const double* points, size_t count,
                           ist_surface_point_t* answers) {
  const ist_placed_t at = placed(solid, &desk.a);
  return ist_closest_point(&at, points, count, answers, sizeof *answers);
}
EXPORT(contains)
ist_status_t contains(solid_t solid, const double* points, size_t count,
                      ist_yes_no_t* inside) {
  const ist_placed_t at = placed(solid, &desk.a);
  return ist_contains(&at, points, count, inside);
}
_Static_assert(sizeof(ist_ray_t) == 56 && sizeof(ist_ray_hit_t) == 64, "ray");
_Static_assert(sizeof(ist_surface_point_t) == 72 && sizeof(ist_yes_no_t) == 4, "point");

/* --- Motions: of place B, from there to place A ------------------------------------------------
 */

/* `numbers`: duration, then the point that moves straight. Writes the motion to motion_b. */
EXPORT(motion_between) ist_status_t motion_between(void) {
  return ist_motion_between(&desk.b.pose, &desk.a.pose, desk.numbers[0], desk.numbers + 1,
                            desk.b.scale, &desk.motion_b);
}

/* `numbers`: the time. Overwrites place B. */
EXPORT(moved) ist_status_t moved(void) {
  return ist_moved(&desk.b.pose, desk.b.scale, &desk.motion_b, desk.numbers[0], &desk.b.pose);
}

EXPORT(time_of_impact) ist_status_t time_of_impact(solid_t a, solid_t b) {
  const ist_placed_t first = placed(a, &desk.a), second = placed(b, &desk.b);
  return ist_time_of_impact(&first, &second, &desk.motion_a, &desk.motion_b, &desk.impact_settings,
                            &desk.workspace, &desk.impact);
}

/* --- Batches: one call for many pairs, with the settings on the desk ----------------------------
 */

typedef struct asked_pair {
  solid_t a, b;
  place_t place_a, place_b;
} asked_pair_t;
_Static_assert(offsetof(asked_pair_t, place_a) == 8 && sizeof(asked_pair_t) == 136, "pair");

/* answers[i] has the status of its own pair, errors included. */
EXPORT(penetration_batch)
void penetration_batch(const asked_pair_t* pairs, size_t count, ist_penetration_t* answers) {
  size_t i;
  for (i = 0; i < count; ++i) {
    const ist_placed_t a = placed(pairs[i].a, &pairs[i].place_a),
                       b = placed(pairs[i].b, &pairs[i].place_b);
    answers[i].size = sizeof answers[i];
    ist_penetration(&a, &b, &desk.settings, &desk.workspace, &answers[i]);
  }
}

/* `patches`: memory for `most` patches a pair, of which counts[i] are written. */
EXPORT(contact_patches_batch)
void contact_patches_batch(const asked_pair_t* pairs, size_t count, ist_penetration_t* wholes,
                           ist_contact_patch_t* patches, uint32_t most, uint32_t* counts) {
  size_t i;
  for (i = 0; i < count; ++i) {
    const ist_placed_t a = placed(pairs[i].a, &pairs[i].place_a),
                       b = placed(pairs[i].b, &pairs[i].place_b);
    ist_contact_patches_t found = {.size = sizeof found,
                                   .patch_size = sizeof patches[0],
                                   .patches = patches + i * most,
                                   .capacity = most};
    wholes[i].size = sizeof wholes[i];
    ist_contact_patches(&a, &b, &desk.settings, &desk.workspace, &found, &wholes[i]);
    counts[i] = (uint32_t)found.count;
  }
}
