/* Scenes for JavaScript. */
#include <ist/c_scene.h>
#include <stdlib.h>

#include "desk.h"

/* Null if there is no memory. */
EXPORT(scene_make) ist_scene_t* scene_make(size_t max_bodies, size_t max_pairs) {
  const ist_scene_settings_t settings = {.size = sizeof settings,
                                         .patches_per_pair = 1,
                                         .max_bodies = max_bodies,
                                         .max_pairs = max_pairs};
  ist_scene_t* const scene = calloc(1, sizeof *scene);
  if (scene == NULL || ist_scene_make(&settings, scene) == IST_OK) return scene;
  free(scene);
  return NULL;
}
EXPORT(scene_release) void scene_release(ist_scene_t* scene) {
  ist_scene_release(scene);
  free(scene);
}

/* At place A. */
EXPORT(scene_add)
ist_status_t scene_add(ist_scene_t* scene, solid_t solid, uint32_t number, uint32_t is_still,
                       uint32_t group, uint32_t layers, uint32_t meets) {
  const ist_placed_t at = placed(solid, &desk.a);
  const ist_scene_body_t body = {.size = sizeof body,
                                 .number = number,
                                 .solid = &at,
                                 .is_still = is_still,
                                 .group = group,
                                 .layers = layers,
                                 .meets = meets};
  return ist_scene_add(scene, &body);
}
EXPORT(scene_remove) ist_status_t scene_remove(ist_scene_t* scene, uint32_t number) {
  return ist_scene_remove(scene, number);
}
EXPORT(scene_set_poses)
ist_status_t scene_set_poses(ist_scene_t* scene, const uint32_t* numbers, const ist_pose_t* poses,
                             size_t count) {
  return ist_scene_set_poses(scene, numbers, poses, count);
}
_Static_assert(sizeof(ist_pose_t) == 56, "pose");

/* With the settings on the desk. */
EXPORT(scene_set_rule)
ist_status_t scene_set_rule(ist_scene_t* scene, uint32_t group_a, uint32_t group_b,
                            ist_scene_answer_t answer, double margin) {
  const ist_scene_rule_t rule = {.size = sizeof rule,
                                 .answer = answer,
                                 .penetration = &desk.settings,
                                 .margin = margin};
  return ist_scene_set_rule(scene, group_a, group_b, &rule);
}
EXPORT(scene_join)
ist_status_t scene_join(ist_scene_t* scene, uint32_t a, uint32_t b, uint32_t joined) {
  return ist_scene_join(scene, a, b, joined);
}

/* Writes the results to `step`, valid until the next call. */
EXPORT(scene_step) ist_status_t scene_step(ist_scene_t* scene, ist_scene_step_t* step) {
  step->size = sizeof *step;
  return ist_scene_take_step(scene, NULL, step);
}
_Static_assert(sizeof(ist_scene_step_t) == 36 && sizeof(ist_scene_pair_t) == 24, "step");

/* Writes the answers of a pair of the last step to the desk. Returns the status of the penetration. */
EXPORT(scene_answers)
ist_status_t scene_answers(const ist_scene_t* scene, const ist_scene_pair_t* pair) {
  ist_scene_get_separation(scene, pair, &desk.separation);
  return ist_scene_get_penetration(scene, pair, &desk.penetration);
}

EXPORT(scene_raycast)
ist_status_t scene_raycast(const ist_scene_t* scene, const ist_ray_t* rays, size_t count,
                           uint32_t* numbers, ist_ray_hit_t* hits) {
  return ist_scene_raycast(scene, rays, count, numbers, hits, sizeof *hits);
}
EXPORT(scene_nearest)
ist_status_t scene_nearest(const ist_scene_t* scene, const double* points, size_t count,
                           double max_distance, uint32_t* numbers, ist_surface_point_t* answers) {
  return ist_scene_nearest(scene, points, count, max_distance, numbers, answers, sizeof *answers);
}
