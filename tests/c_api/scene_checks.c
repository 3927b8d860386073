/* Scenes, right and wrong. */
#include <ist/c_scene.h>
#include <math.h>

#include "scene.h"

static int32_t none_meet(const void* context, uint32_t a, uint32_t b) {
  return *(const int*)context != 0 && a != b;
}

static int bodies_are_added(scene_t* s, ist_scene_t* scene) {
  const ist_scene_settings_t settings = {.size = sizeof settings, .max_bodies = 3};
  ist_scene_settings_t wrong = settings;
  ist_placed_t unknown = s->a;
  ist_scene_body_t body = {.size = sizeof body, .number = 4, .solid = &s->a};
  ist_scene_t empty = {{0}};
  wrong.workers = 1 << 20;
  CHECK(ist_scene_make(NULL, NULL) == IST_NULL_POINTER);
  CHECK(ist_scene_make(&wrong, scene) == IST_INVALID_INPUT);
  wrong.size = 0;
  CHECK(ist_scene_make(&wrong, scene) == IST_WRONG_SIZE);
  CHECK(ist_scene_add(scene, &body) == IST_NO_HANDLE); /* a failure leaves it empty */
  CHECK(ist_scene_make(NULL, scene) == IST_OK && ist_scene_release(scene) == IST_OK);
  CHECK(ist_scene_release(scene) == IST_NO_HANDLE && ist_scene_release(NULL) == IST_NULL_POINTER);
  CHECK(ist_scene_make(&settings, scene) == IST_OK);

  CHECK(ist_scene_add(scene, &body) == IST_OK && ist_scene_add(scene, &body) == IST_NUMBER_TAKEN);
  CHECK(ist_scene_add(NULL, &body) == IST_NULL_POINTER);
  CHECK(ist_scene_add(&empty, &body) == IST_NO_HANDLE);
  CHECK(ist_scene_add(scene, NULL) == IST_NULL_POINTER);
  body.number = 2;
  body.group = 8;
  CHECK(ist_scene_add(scene, &body) == IST_INVALID_INPUT);
  body.group = 1;
  unknown.asset = NULL;
  body.solid = &unknown;
  CHECK(ist_scene_add(scene, &body) == IST_NULL_POINTER);
  body.solid = NULL;
  CHECK(ist_scene_add(scene, &body) == IST_NULL_POINTER);
  body.solid = &s->b;
  CHECK(ist_scene_add(scene, &body) == IST_OK);
  body.number = 9;
  CHECK(ist_scene_add(scene, &body) == IST_OK && ist_scene_remove(scene, 9) == IST_OK);
  CHECK(ist_scene_remove(scene, 9) == IST_NO_BODY);
  CHECK(ist_scene_add(scene, &body) == IST_OK);
  body.number = 10;
  CHECK(ist_scene_add(scene, &body) == IST_SCENE_FULL);
  CHECK(ist_scene_remove(scene, 9) == IST_OK);
  body.size = 0;
  CHECK(ist_scene_add(scene, &body) == IST_WRONG_SIZE);
  return 0;
}

static int rules_are_kept(ist_scene_t* scene) {
  const ist_penetration_settings_t wrong = {.size = sizeof wrong, .measure = 77};
  const ist_impact_settings_t endless = {.size = sizeof endless, .duration = INFINITY};
  ist_scene_rule_t rule = {.size = sizeof rule, .answer = IST_SCENE_IMPACT, .impact = &endless};
  CHECK(ist_scene_set_rule(scene, 0, 1, &rule) == IST_INVALID_INPUT);
  rule.impact = NULL;
  rule.margin = -1;
  CHECK(ist_scene_set_rule(scene, 0, 1, &rule) == IST_INVALID_INPUT);
  rule.margin = 0;
  rule.answer = 6;
  CHECK(ist_scene_set_rule(scene, 0, 1, &rule) == IST_INVALID_INPUT);
  rule.answer = IST_SCENE_PATCHES;
  rule.penetration = &wrong;
  CHECK(ist_scene_set_rule(scene, 0, 1, &rule) == IST_INVALID_INPUT);
  rule.penetration = NULL;
  CHECK(ist_scene_set_rule(scene, 0, 8, &rule) == IST_INVALID_INPUT);
  CHECK(ist_scene_set_rule(NULL, 0, 1, &rule) == IST_NULL_POINTER);
  CHECK(ist_scene_set_rule(scene, 0, 1, NULL) == IST_OK);
  CHECK(ist_scene_set_rule(scene, 0, 1, &rule) == IST_OK);
  rule.size = 0;
  CHECK(ist_scene_set_rule(scene, 0, 1, &rule) == IST_WRONG_SIZE);
  return 0;
}

static int steps_are_those_of_queries(scene_t* s, ist_scene_t* scene) {
  ist_scene_step_t step = {.size = sizeof step};
  ist_penetration_t found = {.size = sizeof found}, alone = {.size = sizeof alone};
  ist_separation_t apart = {.size = sizeof apart};
  ist_impact_t impact = {.size = sizeof impact}, impact_alone = {.size = sizeof impact_alone};
  ist_contact_patch_t room[8], room_alone[8];
  ist_contact_patches_t patches = {.size = sizeof patches, .patch_size = sizeof room[0]};
  ist_contact_patches_t patches_alone = {.size = sizeof patches, .patch_size = sizeof room[0]};
  ist_parallel_t parallel = {.size = sizeof parallel};
  ist_scene_rule_t rule = {.size = sizeof rule, .answer = IST_SCENE_IMPACT};
  const uint32_t numbers[] = {2, 17};
  ist_pose_t poses[2];
  ist_motion_t motions[2] = {{.velocity = {1, 2, 3}}, {.velocity = {0, 0, 0}}};
  ist_scene_pair_t pair;
  int meets = 0;
  poses[0] = poses[1] = s->b.pose;
  patches.patches = room;
  patches_alone.patches = room_alone;
  patches.capacity = patches_alone.capacity = 8;
  CHECK(ist_scene_take_step(scene, &parallel, &step) == IST_OK);
  CHECK(step.pair_count == 1 && step.boxes_met == 1 && step.ended_count == 0);
  pair = step.pairs[0];
  CHECK(pair.a == 2 && pair.b == 4 && pair.stays == 0);
  CHECK(ist_contact_patches(&s->b, &s->a, NULL, &s->workspace, &patches_alone, &alone) == IST_OK);
  CHECK(ist_scene_get_penetration(scene, &pair, &found) == IST_OK && found.volume > 0);
  CHECK(memcmp(&found, &alone, sizeof found) == 0);
  CHECK(ist_scene_get_patches(scene, &pair, &patches) == IST_OK);
  CHECK(patches.count == patches_alone.count && patches.count == pair.patch_count);
  CHECK(memcmp(room, room_alone, patches.count * sizeof room[0]) == 0);
  patches.capacity = 1;
  CHECK(ist_scene_get_patches(scene, &pair, &patches) == IST_OK && patches.count == 1);
  CHECK(ist_scene_get_separation(scene, &pair, &apart) == IST_OK && apart.distance == 0);
  CHECK(ist_scene_take_step(scene, NULL, &step) == IST_OK && step.pairs[0].stays == 1);

  CHECK(ist_scene_set_rule(scene, 0, 1, &rule) == IST_OK);
  CHECK(ist_scene_set_poses(scene, numbers, poses, 2) == IST_NO_BODY);
  CHECK(ist_scene_set_motions(scene, numbers, motions, 1) == IST_OK);
  CHECK(ist_scene_take_step(scene, NULL, &step) == IST_OK && step.pair_count == 1);
  CHECK(ist_time_of_impact(&s->b, &s->a, &motions[0], NULL, NULL, &s->workspace, &impact_alone) >=
        0);
  CHECK(ist_scene_get_impact(scene, &step.pairs[0], &impact) >= 0);
  CHECK(memcmp(&impact, &impact_alone, sizeof impact) == 0);

  CHECK(ist_scene_join(scene, 4, 2, 1) == IST_OK);
  CHECK(ist_scene_take_step(scene, NULL, &step) == IST_OK && step.pair_count == 0);
  CHECK(step.ended_count == 1 && step.ended[0].a == 2 && step.ended[0].b == 4);
  CHECK(ist_scene_join(scene, 4, 2, 0) == IST_OK);
  CHECK(ist_scene_set_filter(scene, none_meet, &meets) == IST_OK);
  CHECK(ist_scene_take_step(scene, NULL, &step) == IST_OK && step.pair_count == 0);
  CHECK(ist_scene_set_filter(scene, NULL, NULL) == IST_OK);
  CHECK(ist_scene_take_step(scene, NULL, &step) == IST_OK && step.pair_count == 1);
  poses[0].t[0] = NAN;
  CHECK(ist_scene_set_poses(scene, numbers, poses, 1) == IST_OK);
  CHECK(ist_scene_take_step(scene, NULL, &step) == IST_OK && step.pair_count == 0);
  CHECK(step.refused_count == 1 && step.refused[0] == 2);

  CHECK(ist_scene_take_step(NULL, NULL, &step) == IST_NULL_POINTER);
  CHECK(is_empty(&step, sizeof step, IST_NULL_POINTER));
  CHECK(ist_scene_take_step(scene, NULL, NULL) == IST_NULL_POINTER);
  parallel.size = 0;
  CHECK(ist_scene_take_step(scene, &parallel, &step) == IST_WRONG_SIZE);
  step.size = 0;
  CHECK(ist_scene_take_step(scene, NULL, &step) == IST_WRONG_SIZE);
  CHECK(ist_scene_get_penetration(scene, NULL, &found) == IST_NULL_POINTER);
  CHECK(ist_scene_get_penetration(NULL, &pair, &found) == IST_NULL_POINTER);
  CHECK(ist_scene_get_separation(scene, &pair, NULL) == IST_NULL_POINTER);
  CHECK(ist_scene_get_patches(scene, NULL, &patches) == IST_NULL_POINTER);
  patches.patch_size = 1;
  CHECK(ist_scene_get_patches(scene, &pair, &patches) == IST_WRONG_SIZE && patches.count == 0);
  impact.size = 0;
  CHECK(ist_scene_get_impact(scene, &pair, &impact) == IST_WRONG_SIZE);
  CHECK(ist_scene_set_poses(scene, NULL, poses, 1) == IST_NULL_POINTER);
  CHECK(ist_scene_set_motions(scene, numbers, NULL, 1) == IST_NULL_POINTER);
  CHECK(ist_scene_set_poses(NULL, numbers, poses, 1) == IST_NULL_POINTER);
  CHECK(ist_scene_join(NULL, 1, 2, 1) == IST_NULL_POINTER);
  CHECK(ist_scene_set_filter(NULL, NULL, NULL) == IST_NULL_POINTER);
  return 0;
}

static int rays_and_boxes_find_bodies(scene_t* s, ist_scene_t* scene) {
  const ist_ray_t ray = {.origin = {-10, 0.013, 0.017}, .direction = {1, 0, 0}};
  const double low[3] = {-100, -100, -100}, high[3] = {100, 100, 100};
  uint32_t number = 77, numbers[4];
  ist_ray_hit_t hit, alone;
  ist_surface_point_t near, foot;
  size_t count = 5;
  CHECK(ist_raycast(&s->a, &ray, 1, &alone, sizeof alone) >= IST_MISSING_DATA);
  CHECK(ist_scene_raycast(scene, &ray, 1, &number, &hit, sizeof hit) == IST_OK);
  if (alone.status == IST_OK) CHECK(number == 4 && hit.distance == alone.distance);
  const ist_ray_t none = {{0, 0, 0}, {0, 0, 0}, 0};
  const double none_at[3] = {NAN, 0, 0};
  CHECK(ist_scene_raycast(scene, &none, 1, &number, &hit, sizeof hit) == IST_INVALID_INPUT);
  CHECK(hit.status == IST_INVALID_INPUT && hit.distance != hit.distance);
  CHECK(ist_scene_raycast(scene, &ray, 1, &number, &hit, 3) == IST_WRONG_SIZE);
  CHECK(ist_scene_raycast(scene, NULL, 1, &number, &hit, sizeof hit) == IST_NULL_POINTER);
  CHECK(ist_scene_raycast(NULL, &ray, 1, &number, &hit, sizeof hit) == IST_NULL_POINTER);
  CHECK(ist_closest_point(&s->a, low, 1, &foot, sizeof foot) >= IST_MISSING_DATA);
  CHECK(ist_scene_nearest(scene, low, 1, HUGE_VAL, &number, &near, sizeof near) == IST_OK);
  if (foot.status == IST_OK) CHECK(number == 4 && near.distance == foot.distance);
  CHECK(ist_scene_nearest(scene, low, 1, 1, &number, &near, sizeof near) == IST_OK);
  CHECK(number == 0 && near.distance == HUGE_VAL);
  CHECK(ist_scene_nearest(scene, low, 1, NAN, &number, &near, sizeof near) == IST_INVALID_INPUT);
  CHECK(near.status == IST_INVALID_INPUT && near.distance != near.distance);
  CHECK(ist_scene_nearest(scene, low, 1, 1, &number, &near, 3) == IST_WRONG_SIZE);
  CHECK(ist_scene_nearest(scene, NULL, 1, 1, &number, &near, sizeof near) == IST_NULL_POINTER);
  CHECK(ist_scene_nearest(NULL, low, 1, 1, &number, &near, sizeof near) == IST_NULL_POINTER);
  CHECK(ist_scene_in_box(scene, low, high, numbers, 4, &count) == IST_OK && count == 1);
  CHECK(numbers[0] == 4);
  CHECK(ist_scene_in_box(scene, low, high, NULL, 0, &count) == IST_OK && count == 1);
  CHECK(ist_scene_in_box(scene, low, high, NULL, 1, &count) == IST_NULL_POINTER && count == 0);
  CHECK(ist_scene_in_box(scene, high, low, numbers, 4, &count) == IST_INVALID_INPUT && count == 0);
  CHECK(ist_scene_in_box(scene, none_at, high, numbers, 4, &count) == IST_INVALID_INPUT);
  CHECK(ist_scene_in_box(scene, NULL, high, numbers, 4, &count) == IST_NULL_POINTER);
  CHECK(ist_scene_in_box(NULL, low, high, numbers, 4, &count) == IST_NULL_POINTER);
  CHECK(ist_scene_in_box(scene, low, high, numbers, 4, NULL) == IST_NULL_POINTER);
  return 0;
}

int scenes_answer(scene_t* s) {
  ist_scene_t scene = {{0}};
  if (bodies_are_added(s, &scene) != 0 || rules_are_kept(&scene) != 0 ||
      steps_are_those_of_queries(s, &scene) != 0 || rays_and_boxes_find_bodies(s, &scene) != 0)
    return 1;
  CHECK(ist_scene_release(&scene) == IST_OK);
  return 0;
}
