/* Protrusion, fit, wrenches, rays, points, motions and batches, as a page's JavaScript calls them. */
#include "desk.h"

/* --- Of answers that lie on the desk ---------------------------------------------------------- */

EXPORT(without_protrusion)
ist_status_t without_protrusion(const ist_tree_t* a, const ist_tree_t* b) {
  const ist_placed_tree_t first = placed(a, &desk.a), second = placed(b, &desk.b);
  return ist_without_protrusion(&desk.penetration, &first, &second, &desk.penetration);
}

EXPORT(patches_without_protrusion)
ist_status_t patches_without_protrusion(const ist_tree_t* a, const ist_tree_t* b, uint32_t count) {
  const ist_placed_tree_t first = placed(a, &desk.a), second = placed(b, &desk.b);
  ist_contact_patches_t found = {sizeof found, sizeof desk.patches[0], desk.patches, count, count};
  return ist_patches_without_protrusion(&first, &second, &desk.settings, &found);
}

EXPORT(pair_fit) ist_status_t pair_fit(const ist_tree_t* a, const ist_tree_t* b) {
  const ist_placed_tree_t first = placed(a, &desk.a), second = placed(b, &desk.b);
  return ist_get_pair_fit(&first, &second, &desk.fit);
}

/* Of the penetration or, if `is_patch`, of the first patch; points lie in `numbers`. */
EXPORT(wrenches) ist_status_t wrenches(int32_t is_patch) {
  const double *const of_a = desk.numbers, *const of_b = desk.numbers + 3;
  return is_patch ? ist_patch_wrenches(&desk.patches[0], &desk.b.pose, of_a, of_b, &desk.wrenches)
                  : ist_wrenches(&desk.penetration, &desk.b.pose, of_a, of_b, &desk.wrenches);
}

/* --- Rays and points: of a tree, or of a field where `tree` is null, at place A ----------------
 */

EXPORT(raycast)
ist_status_t raycast(const ist_tree_t* tree, const ist_field_t* field, const ist_ray_t* rays,
                     size_t count, ist_ray_hit_t* hits) {
  const ist_placed_tree_t solid = placed(tree, &desk.a);
  const ist_placed_field_t shape = placed_field(field, &desk.a);
  return tree == NULL ? ist_field_raycast(&shape, rays, count, hits, sizeof *hits)
                      : ist_raycast(&solid, rays, count, hits, sizeof *hits);
}
EXPORT(closest_point)
ist_status_t closest_point(const ist_tree_t* tree, const ist_field_t* field, const double* points,
                           size_t count, ist_surface_point_t* answers) {
  const ist_placed_tree_t solid = placed(tree, &desk.a);
  const ist_placed_field_t shape = placed_field(field, &desk.a);
  return tree == NULL ? ist_field_closest_point(&shape, points, count, answers, sizeof *answers)
                      : ist_closest_point(&solid, points, count, answers, sizeof *answers);
}
EXPORT(contains)
ist_status_t contains(const ist_tree_t* tree, const ist_field_t* field, const double* points,
                      size_t count, ist_overlapping_t* inside) {
  const ist_placed_tree_t solid = placed(tree, &desk.a);
  const ist_placed_field_t shape = placed_field(field, &desk.a);
  return tree == NULL ? ist_field_contains(&shape, points, count, inside)
                      : ist_contains(&solid, points, count, inside);
}
_Static_assert(sizeof(ist_ray_t) == 56 && sizeof(ist_ray_hit_t) == 64, "ray");
_Static_assert(sizeof(ist_surface_point_t) == 72 && sizeof(ist_overlapping_t) == 4, "point");

/* --- Motions: of place B, from there to place A ------------------------------------------------
 */

/* `numbers`: duration, then the point that goes straight on. The motion goes to motion_b. */
EXPORT(motion_between) ist_status_t motion_between(void) {
  return ist_motion_between(&desk.b.pose, &desk.a.pose, desk.numbers[0], desk.numbers + 1,
                            desk.b.scale, &desk.motion_b);
}

/* `numbers`: the time. Place B is written over. */
EXPORT(moved) ist_status_t moved(void) {
  return ist_moved(&desk.b.pose, desk.b.scale, &desk.motion_b, desk.numbers[0], &desk.b.pose);
}

EXPORT(time_of_impact)
ist_status_t time_of_impact(const ist_tree_t* a, const ist_field_t* field, const ist_tree_t* b) {
  const ist_placed_tree_t second = placed(b, &desk.b);
  if (a == NULL) {
    const ist_placed_field_t first = placed_field(field, &desk.a);
    return ist_field_time_of_impact(&first, &second, &desk.motion_a, &desk.motion_b,
                                    &desk.impact_settings, &desk.workspace, &desk.impact);
  }
  const ist_placed_tree_t first = placed(a, &desk.a);
  return ist_time_of_impact(&first, &second, &desk.motion_a, &desk.motion_b, &desk.impact_settings,
                            &desk.workspace, &desk.impact);
}

/* --- Batches: one call for many pairs, with the settings on the desk ----------------------------
 */

typedef struct asked_pair {
  const ist_tree_t* a;      /* or null, */
  const ist_field_t* field; /* and this */
  const ist_tree_t* b;
  uint32_t unused;
  place_t place_a, place_b;
} asked_pair_t;
_Static_assert(offsetof(asked_pair_t, place_a) == 16 && sizeof(asked_pair_t) == 144, "pair");

/* answers[i] has the status of its own pair, errors included. */
EXPORT(penetration_batch)
void penetration_batch(const asked_pair_t* pairs, size_t count, ist_penetration_t* answers) {
  size_t i;
  for (i = 0; i < count; ++i) {
    const asked_pair_t* const pair = &pairs[i];
    const ist_placed_tree_t b = placed(pair->b, &pair->place_b);
    answers[i].size = sizeof answers[i];
    if (pair->a == NULL) {
      const ist_placed_field_t a = placed_field(pair->field, &pair->place_a);
      ist_field_penetration(&a, &b, &desk.settings, &desk.workspace, &answers[i]);
    } else {
      const ist_placed_tree_t a = placed(pair->a, &pair->place_a);
      ist_penetration(&a, &b, &desk.settings, &desk.workspace, &answers[i]);
    }
  }
}

/* `patches`: room for `most` a pair, of which counts[i] are written. */
EXPORT(contact_patches_batch)
void contact_patches_batch(const asked_pair_t* pairs, size_t count, ist_penetration_t* wholes,
                           ist_contact_patch_t* patches, uint32_t most, uint32_t* counts) {
  size_t i;
  for (i = 0; i < count; ++i) {
    const asked_pair_t* const pair = &pairs[i];
    const ist_placed_tree_t b = placed(pair->b, &pair->place_b);
    ist_contact_patches_t found = {.size = sizeof found,
                                   .patch_size = sizeof patches[0],
                                   .patches = patches + i * most,
                                   .capacity = most};
    wholes[i].size = sizeof wholes[i];
    if (pair->a == NULL) {
      const ist_placed_field_t a = placed_field(pair->field, &pair->place_a);
      ist_field_contact_patches(&a, &b, &desk.settings, &desk.workspace, &found, &wholes[i]);
    } else {
      const ist_placed_tree_t a = placed(pair->a, &pair->place_a);
      ist_contact_patches(&a, &b, &desk.settings, &desk.workspace, &found, &wholes[i]);
    }
    counts[i] = (uint32_t)found.count;
  }
}
