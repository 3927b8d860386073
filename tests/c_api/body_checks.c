/* Bodies and their motions. */
#include <math.h>

#include "scene.h"

int bodies_are_told(scene_t* s) {
  ist_mass_properties_t mass = {.size = sizeof mass}, placed_mass = {.size = sizeof placed_mass};
  ist_bounds_t bounds = {.size = sizeof bounds}, placed_bounds = {.size = sizeof placed_bounds};
  ist_penetration_t contact = {.size = sizeof contact};
  ist_wrenches_t wrenches = {.size = sizeof wrenches}, of_patches = {.size = sizeof of_patches};
  ist_contact_patch_t storage[4];
  ist_contact_patches_t patches = {.size = sizeof patches, .patch_size = sizeof storage[0]};
  ist_motion_t towards = {.velocity = {1, 0, 0}};
  ist_placed_t wrong = s->b;
  const ist_asset_t empty = {0};
  const double origin[3] = {0, 0, 0};
  double rate = 1, by_patches = 0, part, sum = 0;
  size_t i;
  int k;

  CHECK(ist_asset_get_mass_properties(&s->tree_b, &mass) == IST_OK && mass.volume > 0);
  CHECK(ist_asset_get_bounds(&s->tree_b, &bounds) == IST_OK);
  CHECK(ist_placed_mass_properties(&s->b, &placed_mass) == IST_OK);
  CHECK(ist_placed_bounds(&s->b, &placed_bounds) == IST_OK);
  CHECK(placed_mass.volume == mass.volume && placed_bounds.radius == bounds.radius);
  CHECK(fabs(placed_mass.centre_of_mass[0] - mass.centre_of_mass[0] - s->b.pose.t[0]) <= 1e-12);
  CHECK(ist_asset_get_mass_properties(NULL, &mass) == IST_NULL_POINTER);
  CHECK(is_empty(&mass, sizeof mass, IST_NULL_POINTER));
  CHECK(ist_asset_get_mass_properties(&empty, &mass) == IST_NO_HANDLE);
  CHECK(ist_asset_get_mass_properties(&s->tree_b, NULL) == IST_NULL_POINTER);
  CHECK(ist_asset_get_bounds(NULL, &bounds) == IST_NULL_POINTER);
  CHECK(ist_asset_get_bounds(&s->tree_b, NULL) == IST_NULL_POINTER);
  CHECK(ist_placed_mass_properties(NULL, &mass) == IST_NULL_POINTER);
  CHECK(ist_placed_mass_properties(&s->b, NULL) == IST_NULL_POINTER);
  CHECK(ist_placed_bounds(NULL, &bounds) == IST_NULL_POINTER);
  CHECK(ist_placed_bounds(&s->b, NULL) == IST_NULL_POINTER);
  wrong.pose.q[0] = 3; /* a length that is normalised */
  CHECK(ist_placed_mass_properties(&wrong, &placed_mass) == IST_OK && placed_mass.volume > 0);
  wrong.pose.q[0] = 0;
  CHECK(ist_placed_mass_properties(&wrong, &mass) == IST_INVALID_INPUT);
  CHECK(ist_placed_bounds(&wrong, &bounds) == IST_INVALID_INPUT);
  CHECK(is_refused(&bounds, sizeof bounds, IST_INVALID_INPUT));
  mass.size = bounds.size = 0;
  CHECK(ist_asset_get_mass_properties(&s->tree_b, &mass) == IST_WRONG_SIZE);
  CHECK(ist_placed_bounds(&s->b, &bounds) == IST_WRONG_SIZE);

  patches.patches = storage;
  patches.capacity = 4;
  CHECK(ist_contact_patches(&s->a, &s->b, NULL, &s->workspace, &patches, &contact) == IST_OK);
  CHECK(ist_wrenches(&contact, &s->b.pose, origin, origin, &wrenches) == IST_OK);
  for (k = 0; k < 3; ++k) {
    CHECK(wrenches.on_b.force[k] == contact.force[k]);
    CHECK(wrenches.on_a.torque[k] == -wrenches.on_b.torque[k]);
    sum += fabs(wrenches.on_b.force[k]);
  }
  CHECK(ist_volume_rate(&contact, &s->a, &s->b, NULL, &towards, &rate) == IST_OK);
  CHECK(rate == -contact.force[0]);
  for (i = 0; i < patches.count; ++i) {
    CHECK(ist_patch_volume_rate(&storage[i], &s->a, &s->b, NULL, &towards, &part) == IST_OK);
    by_patches += part;
    CHECK(ist_patch_wrenches(&storage[i], &s->b.pose, origin, origin, &of_patches) == IST_OK);
    CHECK(of_patches.on_b.force[0] == storage[i].force[0]);
  }
  CHECK(fabs(by_patches - rate) <= 1e-12 * sum);
  CHECK(ist_wrenches(NULL, &s->b.pose, origin, origin, &wrenches) == IST_NULL_POINTER);
  CHECK(wrenches.on_b.force[0] == 0);
  CHECK(ist_wrenches(&contact, NULL, origin, origin, &wrenches) == IST_NULL_POINTER);
  CHECK(ist_wrenches(&contact, &s->b.pose, NULL, origin, &wrenches) == IST_NULL_POINTER);
  CHECK(ist_wrenches(&contact, &s->b.pose, origin, NULL, &wrenches) == IST_NULL_POINTER);
  CHECK(ist_wrenches(&contact, &s->b.pose, origin, origin, NULL) == IST_NULL_POINTER);
  CHECK(ist_patch_wrenches(NULL, &s->b.pose, origin, origin, &wrenches) == IST_NULL_POINTER);
  CHECK(ist_volume_rate(NULL, &s->a, &s->b, NULL, NULL, &rate) == IST_NULL_POINTER && rate == 0);
  CHECK(ist_volume_rate(&contact, &s->a, NULL, NULL, NULL, &rate) == IST_NULL_POINTER);
  CHECK(ist_volume_rate(&contact, &s->a, &s->b, NULL, NULL, NULL) == IST_NULL_POINTER);
  CHECK(ist_patch_volume_rate(NULL, &s->a, &s->b, NULL, NULL, &rate) == IST_NULL_POINTER);
  wrenches.size = 0;
  CHECK(ist_wrenches(&contact, &s->b.pose, origin, origin, &wrenches) == IST_WRONG_SIZE);
  contact.size = 0;
  CHECK(ist_volume_rate(&contact, &s->a, &s->b, NULL, NULL, &rate) == IST_WRONG_SIZE);
  return 0;
}

int impacts_are_found(scene_t* s) {
  const ist_pose_t here = IST_POSE_IDENTITY;
  ist_pose_t there = IST_POSE_IDENTITY, at;
  ist_motion_t motion;
  ist_impact_t impact = {.size = sizeof impact}, other = {.size = sizeof other};
  ist_impact_settings_t settings = {.size = sizeof settings, .duration = 1};
  ist_shape_t field = {.size = sizeof field, .kind = IST_HALF_SPACE};
  ist_placed_t floor = {.size = sizeof floor, .shape = &field, .pose = here};
  ist_placed_t b = s->b;
  ist_workspace_t none = {0};
  field.as.half_space.normal[2] = 1;
  b.pose.t[2] = 10;
  there.t[2] = -20;
  CHECK(ist_motion_between(&here, &there, 1, NULL, 0, &motion) == IST_OK);
  CHECK(motion.velocity[2] == -20 && motion.angular_velocity[2] == 0);
  CHECK(ist_moved(&b.pose, 0, &motion, 0.5, &at) == IST_OK);
  CHECK(at.t[2] == 0 && at.t[0] == b.pose.t[0]);

  CHECK(ist_time_of_impact(&s->a, &b, NULL, &motion, &settings, &s->workspace, &impact) >= 0);
  CHECK(impact.kind == IST_IMPACT || impact.kind == IST_IMPACT_UNRESOLVED);
  CHECK(impact.time > 0.3 && impact.time < 0.6);
  CHECK(ist_time_of_impact(&s->a, &b, NULL, &motion, NULL, &s->workspace, &other) >= 0);
  CHECK(memcmp(&impact, &other, sizeof impact) == 0);
  CHECK(ist_time_of_impact(&s->a, &b, NULL, NULL, NULL, &s->workspace, &impact) == IST_OK);
  CHECK(impact.kind == IST_NO_IMPACT && impact.time == 1);
  CHECK(ist_time_of_impact(&s->a, &s->b, NULL, &motion, NULL, &s->workspace, &impact) == IST_OK);
  CHECK(impact.kind == IST_IMPACT_OVERLAPPING || impact.kind == IST_IMPACT_UNRESOLVED);
  CHECK(ist_time_of_impact(&floor, &b, NULL, &motion, NULL, &s->workspace, &impact) >= 0);
  CHECK(impact.time > 0.3 && impact.time < 0.5);
  settings.max_visits = 1;
  CHECK(ist_time_of_impact(&s->a, &b, NULL, &motion, &settings, &s->workspace, &impact) ==
        IST_BUDGET_EXHAUSTED);

  CHECK(ist_time_of_impact(NULL, &b, NULL, &motion, NULL, &s->workspace, &impact) ==
        IST_NULL_POINTER);
  CHECK(is_refused(&impact, sizeof impact, IST_NULL_POINTER));
  CHECK(ist_time_of_impact(&s->a, NULL, NULL, &motion, NULL, &s->workspace, &impact) ==
        IST_NULL_POINTER);
  CHECK(ist_time_of_impact(&s->a, &b, NULL, &motion, NULL, NULL, &impact) == IST_NULL_POINTER);
  CHECK(ist_time_of_impact(&s->a, &b, NULL, &motion, NULL, &s->workspace, NULL) ==
        IST_NULL_POINTER);
  CHECK(ist_time_of_impact(&s->a, &b, NULL, &motion, NULL, &none, &impact) == IST_NO_HANDLE);
  CHECK(ist_time_of_impact(NULL, &b, NULL, &motion, NULL, &s->workspace, &impact) ==
        IST_NULL_POINTER);
  settings.duration = 0; /* as a zeroed struct has it */
  CHECK(ist_time_of_impact(&s->a, &b, NULL, &motion, &settings, &s->workspace, &impact) ==
        IST_NO_DURATION);
  CHECK(is_refused(&impact, sizeof impact, IST_NO_DURATION));
  settings.duration = -1;
  CHECK(ist_time_of_impact(&s->a, &b, NULL, &motion, &settings, &s->workspace, &impact) ==
        IST_INVALID_INPUT);
  CHECK(is_refused(&impact, sizeof impact, IST_INVALID_INPUT));
  settings.size = 0;
  CHECK(ist_time_of_impact(&s->a, &b, NULL, &motion, &settings, &s->workspace, &impact) ==
        IST_WRONG_SIZE);
  impact.size = 0;
  CHECK(ist_time_of_impact(&s->a, &b, NULL, &motion, NULL, &s->workspace, &impact) ==
        IST_WRONG_SIZE);
  CHECK(ist_motion_between(NULL, &there, 1, NULL, 0, &motion) == IST_NULL_POINTER);
  CHECK(ist_motion_between(&here, NULL, 1, NULL, 0, &motion) == IST_NULL_POINTER);
  CHECK(ist_motion_between(&here, &there, 1, NULL, 0, NULL) == IST_NULL_POINTER);
  CHECK(ist_motion_between(&here, &there, 0, NULL, 0, &motion) == IST_INVALID_INPUT);
  CHECK(ist_moved(NULL, 0, &motion, 1, &at) == IST_NULL_POINTER);
  CHECK(ist_moved(&here, 0, NULL, 1, &at) == IST_NULL_POINTER);
  CHECK(ist_moved(&here, 0, &motion, 1, NULL) == IST_NULL_POINTER);
  CHECK(ist_moved(&here, 0, &motion, NAN, &at) == IST_INVALID_INPUT);
  CHECK(at.q[0] == 0 && at.t[2] == 0);
  at = here;
  CHECK(ist_motion_between(&here, &there, 1, NULL, 0, &motion) == IST_OK);
  CHECK(ist_moved(&at, 0, &motion, 0.5, &at) == IST_OK && at.t[2] == -10); /* in its place */
  CHECK(ist_moved(NULL, 0, &motion, 1, &at) == IST_NULL_POINTER && at.q[0] == 0);
  return 0;
}
