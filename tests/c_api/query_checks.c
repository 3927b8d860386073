/* Queries of two trees, and of a field and a tree. */
#include <math.h>

#include "scene.h"

int penetrations_answer(scene_t* s) {
  ist_penetration_t whole = {.size = sizeof whole}, other = {.size = sizeof other};
  ist_penetration_settings_t settings = {.size = sizeof settings};
  ist_placed_t wrong;
  const ist_asset_t empty = {0};
  ist_workspace_t none = {0};
  ist_asset_info_t info = {.size = sizeof info};
  ist_shape_t field = {.size = sizeof field, .kind = IST_BALL};
  ist_placed_t floor = {.size = sizeof floor};
  ist_status_t status;
  int meshes;

  CHECK(ist_penetration(&s->a, &s->b, NULL, &s->workspace, &whole) == IST_OK);
  CHECK(whole.volume > 0 && whole.volume_min <= whole.volume && whole.volume <= whole.volume_max);
  CHECK(ist_penetration(&s->a, &s->b, &settings, &s->workspace, &other) == IST_OK);
  CHECK(memcmp(&whole, &other, sizeof whole) == 0);
  s->b.scale = 1;
  CHECK(ist_penetration(&s->a, &s->b, &settings, &s->workspace, &other) == IST_OK);
  CHECK(memcmp(&whole, &other, sizeof whole) == 0);
  s->b.scale = 0;
  settings.max_visits = 1;
  CHECK(ist_penetration(&s->a, &s->b, &settings, &s->workspace, &other) == IST_BUDGET_EXHAUSTED);
  CHECK(other.status == IST_BUDGET_EXHAUSTED && other.volume_max > other.volume_min);

  /* Each pointer null. */
  CHECK(ist_penetration(NULL, &s->b, NULL, &s->workspace, &other) == IST_NULL_POINTER);
  CHECK(is_refused(&other, sizeof other, IST_NULL_POINTER));
  CHECK(ist_penetration(&s->a, NULL, NULL, &s->workspace, &other) == IST_NULL_POINTER);
  CHECK(ist_penetration(&s->a, &s->b, NULL, NULL, &other) == IST_NULL_POINTER);
  CHECK(ist_penetration(&s->a, &s->b, NULL, &s->workspace, NULL) == IST_NULL_POINTER);
  wrong = s->a;
  wrong.asset = NULL;
  CHECK(ist_penetration(&wrong, &s->b, NULL, &s->workspace, &other) == IST_NULL_POINTER);

  /* Each size wrong. */
  other.size = sizeof other + 8;
  CHECK(ist_penetration(&s->a, &s->b, NULL, &s->workspace, &other) == IST_WRONG_SIZE);
  other.size = sizeof other;
  wrong = s->a;
  wrong.size = 0;
  CHECK(ist_penetration(&wrong, &s->b, NULL, &s->workspace, &other) == IST_WRONG_SIZE);
  CHECK(ist_penetration(&s->a, &wrong, NULL, &s->workspace, &other) == IST_WRONG_SIZE);
  settings.size = 4;
  CHECK(ist_penetration(&s->a, &s->b, &settings, &s->workspace, &other) == IST_WRONG_SIZE);
  settings.size = sizeof settings;

  /* Handles that are none. */
  wrong = s->a;
  wrong.asset = &empty;
  CHECK(ist_penetration(&wrong, &s->b, NULL, &s->workspace, &other) == IST_NO_HANDLE);
  CHECK(is_refused(&other, sizeof other, IST_NO_HANDLE));
  CHECK(ist_penetration(&s->a, &wrong, NULL, &s->workspace, &other) == IST_NO_HANDLE);
  CHECK(ist_penetration(&s->a, &s->b, NULL, &none, &other) == IST_NO_HANDLE);

  /* The meshes of two, where both hold one; a field has none. */
  settings.max_visits = 0;
  settings.measure = IST_EXACT;
  CHECK(ist_asset_get_info(&s->tree_a, &info) == IST_OK);
  meshes = info.mesh_triangles > 0;
  CHECK(ist_asset_get_info(&s->tree_b, &info) == IST_OK);
  meshes += info.mesh_triangles > 0;
  status = ist_penetration(&s->a, &s->b, &settings, &s->workspace, &other);
  CHECK(status == other.status && status == (meshes == 2 ? IST_OK : IST_MISSING_DATA));
  CHECK(meshes == 2 || (isnan(other.volume) && isnan(other.torque[2])));
  if (meshes == 2) { /* Steps of one motion, here of none: the second opens no node. */
    settings.pair_id = 7;
    CHECK(ist_penetration(&s->a, &s->b, &settings, &s->workspace, &whole) == IST_OK);
    CHECK(ist_penetration(&s->a, &s->b, &settings, &s->workspace, &whole) == IST_OK);
    CHECK(ist_penetration(&s->a, &s->b, &settings, &s->workspace, &whole) == IST_OK);
    CHECK(whole.volume == other.volume && whole.volume_max == other.volume_max);
    CHECK(whole.node_visits == 0 && other.node_visits > 0);
    settings.pair_id = 0;
  }
  floor.shape = &field;
  floor.pose = s->a.pose;
  field.as.ball.radius = 1;
  CHECK(ist_penetration(&floor, &s->b, &settings, &s->workspace, &other) == IST_MISSING_DATA);
  CHECK(isnan(other.volume) && other.status == IST_MISSING_DATA);

  /* Numbers that are none. */
  settings.measure = 3;
  CHECK(ist_penetration(&s->a, &s->b, &settings, &s->workspace, &other) == IST_INVALID_INPUT);
  settings.measure = IST_MATCHED;
  wrong = s->a;
  wrong.pose.t[1] = NAN;
  CHECK(ist_penetration(&wrong, &s->b, NULL, &s->workspace, &other) == IST_INVALID_INPUT);
  CHECK(is_refused(&other, sizeof other, IST_INVALID_INPUT));
  wrong = s->a;
  wrong.scale = -1;
  CHECK(ist_penetration(&wrong, &s->b, NULL, &s->workspace, &other) == IST_INVALID_INPUT);

  settings.spheres_only = 1;
  settings.max_visits = 0;
  CHECK(ist_penetration(&s->a, &s->b, &settings, &s->workspace, &whole) == IST_OK);
  CHECK(ist_without_protrusion(&whole, &s->a, &s->b, &other) == IST_OK);
  CHECK(other.volume <= whole.volume);
  CHECK(ist_without_protrusion(NULL, &s->a, &s->b, &other) == IST_NULL_POINTER);
  CHECK(ist_without_protrusion(&whole, NULL, &s->b, &other) == IST_NULL_POINTER);
  CHECK(ist_without_protrusion(&whole, &s->a, NULL, &other) == IST_NULL_POINTER);
  CHECK(is_refused(&other, sizeof other, IST_NULL_POINTER));
  CHECK(ist_without_protrusion(&whole, &s->a, &s->b, NULL) == IST_NULL_POINTER);
  CHECK(ist_without_protrusion(&whole, &s->a, &s->b, &whole) == IST_OK); /* in its place */
  return 0;
}

int deadlines_limit(scene_t* s) {
  ist_penetration_t whole = {.size = sizeof whole}, apart = {.size = sizeof apart};
  ist_penetration_settings_t settings = {.size = sizeof settings};
  ist_deadline_t deadline = {0};
  int i;
  CHECK(ist_penetration(&s->a, &s->b, NULL, &s->workspace, &whole) == IST_OK);
  CHECK(ist_deadline_limit(&deadline, &settings) == IST_OK); /* all zero: none */
  CHECK(settings.pair_budget == 0 && settings.spheres_only == 0);
  CHECK(ist_deadline_make(100, &deadline) == IST_OK);
  CHECK(ist_deadline_limit(&deadline, &settings) == IST_OK);
  CHECK(settings.pair_budget > 0 && settings.spheres_only == 1);
  CHECK(ist_deadline_too_slow(&deadline) == 0);
  for (i = 0; i < 300; ++i)
    CHECK(ist_deadline_record(&deadline, &whole, 1e6) == IST_OK &&
          ist_deadline_record(&deadline, &apart, 1) == IST_OK);
  CHECK(ist_deadline_too_slow(&deadline) != 0);
  CHECK(ist_deadline_make(100, NULL) == IST_NULL_POINTER);
  CHECK(ist_deadline_limit(NULL, &settings) == IST_NULL_POINTER);
  CHECK(ist_deadline_limit(&deadline, NULL) == IST_NULL_POINTER);
  CHECK(ist_deadline_record(NULL, &whole, 1) == IST_NULL_POINTER);
  CHECK(ist_deadline_record(&deadline, NULL, 1) == IST_NULL_POINTER);
  CHECK(ist_deadline_too_slow(NULL) == 0);
  settings.size = 4;
  CHECK(ist_deadline_limit(&deadline, &settings) == IST_WRONG_SIZE);
  whole.size = 4;
  CHECK(ist_deadline_record(&deadline, &whole, 1) == IST_WRONG_SIZE);
  return 0;
}

int separations_answer(scene_t* s) {
  ist_penetration_t penetration = {.size = sizeof penetration}, lone = {.size = sizeof lone};
  ist_separation_t separation = {.size = sizeof separation}, gap = {.size = sizeof gap};
  ist_separation_settings_t settings = {.size = sizeof settings};
  ist_penetration_settings_t first = {.size = sizeof first};
  const double x = s->b.pose.t[0];
  s->b.pose.t[0] = 10;
  CHECK(ist_separation(&s->a, &s->b, NULL, &s->workspace, &gap) == IST_OK);
  CHECK(gap.distance > 5 && gap.distance_min <= gap.distance && gap.normal[0] > 0.5);
  CHECK(ist_query(&s->a, &s->b, &first, &settings, &s->workspace, &penetration, &separation) ==
        IST_OK);
  CHECK(memcmp(&gap, &separation, sizeof gap) == 0);
  CHECK(ist_penetration(&s->a, &s->b, NULL, &s->workspace, &lone) == IST_OK);
  CHECK(memcmp(&lone, &penetration, sizeof lone) == 0);
  {
    ist_yes_no_t within = IST_UNKNOWN;
    const double distance = gap.distance;
    settings.max_distance = 0.9 * distance;
    settings.pair_id = 5;
    CHECK(ist_separation(&s->a, &s->b, &settings, &s->workspace, &separation) == IST_OK);
    CHECK(separation.distance == settings.max_distance && isinf(separation.distance_max));
    CHECK(isnan(separation.normal[0]) && separation.distance_min == settings.max_distance);
    settings.max_distance = 1.1 * distance;
    CHECK(ist_separation(&s->a, &s->b, &settings, &s->workspace, &separation) == IST_OK);
    CHECK(separation.distance == distance && separation.point_b[0] == gap.point_b[0]);
    settings.max_distance = 0;
    settings.pair_id = 0;
    CHECK(ist_overlap_within(&s->a, &s->b, 2 * distance, &s->workspace, &within) == IST_OK);
    CHECK(within == IST_YES);
    CHECK(ist_overlap_within(&s->a, &s->b, 0.5 * distance, &s->workspace, &within) == IST_OK);
    CHECK(within == IST_NO);
    CHECK(ist_overlap_within(&s->a, &s->b, -1, &s->workspace, &within) == IST_INVALID_INPUT);
    CHECK(within == IST_UNKNOWN);
    CHECK(ist_overlap_within(&s->a, NULL, 1, &s->workspace, &within) == IST_NULL_POINTER);
  }
  settings.max_visits = 1;
  CHECK(ist_separation(&s->a, &s->b, &settings, &s->workspace, &gap) == IST_BUDGET_EXHAUSTED);
  CHECK(ist_query(&s->a, &s->b, NULL, &settings, &s->workspace, &penetration, &separation) ==
        IST_BUDGET_EXHAUSTED);
  CHECK(penetration.status == IST_OK && separation.status == IST_BUDGET_EXHAUSTED);

  CHECK(ist_separation(NULL, &s->b, NULL, &s->workspace, &gap) == IST_NULL_POINTER);
  CHECK(is_refused(&gap, sizeof gap, IST_NULL_POINTER));
  CHECK(ist_separation(&s->a, NULL, NULL, &s->workspace, &gap) == IST_NULL_POINTER);
  CHECK(ist_separation(&s->a, &s->b, NULL, NULL, &gap) == IST_NULL_POINTER);
  CHECK(ist_separation(&s->a, &s->b, NULL, &s->workspace, NULL) == IST_NULL_POINTER);
  settings.size = 0;
  CHECK(ist_separation(&s->a, &s->b, &settings, &s->workspace, &gap) == IST_WRONG_SIZE);
  CHECK(ist_query(&s->a, &s->b, NULL, &settings, &s->workspace, &penetration, &separation) ==
        IST_WRONG_SIZE);
  CHECK(is_refused(&penetration, sizeof penetration, IST_WRONG_SIZE));
  CHECK(ist_query(NULL, &s->b, NULL, NULL, &s->workspace, &penetration, &separation) ==
        IST_NULL_POINTER);
  CHECK(ist_query(&s->a, NULL, NULL, NULL, &s->workspace, &penetration, &separation) ==
        IST_NULL_POINTER);
  CHECK(ist_query(&s->a, &s->b, NULL, NULL, NULL, &penetration, &separation) == IST_NULL_POINTER);
  CHECK(ist_query(&s->a, &s->b, NULL, NULL, &s->workspace, NULL, &separation) == IST_NULL_POINTER);
  CHECK(is_refused(&separation, sizeof separation, IST_NULL_POINTER));
  CHECK(ist_query(&s->a, &s->b, NULL, NULL, &s->workspace, &penetration, NULL) == IST_NULL_POINTER);
  CHECK(is_refused(&penetration, sizeof penetration, IST_NULL_POINTER));
  s->b.pose.t[0] = x;
  return 0;
}

int overlaps_answer(scene_t* s) {
  ist_yes_no_t answer = 77;
  ist_size_match_t fit = {.size = sizeof fit};
  ist_shape_t field = {.size = sizeof field, .kind = IST_HALF_SPACE};
  ist_placed_t floor = {.size = sizeof floor, .shape = &field, .pose = s->a.pose};
  ist_placed_t far_away = s->b;
  ist_workspace_t none = {0};
  field.as.half_space.normal[0] = 1;
  far_away.pose.t[0] = 20;
  CHECK(ist_overlap(&s->a, &s->b, &s->workspace, &answer) == IST_OK && answer == IST_YES);
  CHECK(ist_overlap(&s->a, &far_away, &s->workspace, &answer) == IST_OK);
  CHECK(answer == IST_NO);
  CHECK(ist_overlap(&floor, &s->b, &s->workspace, &answer) == IST_OK);
  CHECK(answer == IST_YES);
  CHECK(ist_overlap(&floor, &far_away, &s->workspace, &answer) == IST_OK);
  CHECK(answer == IST_NO);
  CHECK(ist_overlap(NULL, &s->b, &s->workspace, &answer) == IST_NULL_POINTER);
  CHECK(answer == IST_UNKNOWN);
  CHECK(ist_overlap(&s->a, NULL, &s->workspace, &answer) == IST_NULL_POINTER);
  CHECK(ist_overlap(&s->a, &s->b, NULL, &answer) == IST_NULL_POINTER);
  CHECK(ist_overlap(&s->a, &s->b, &none, &answer) == IST_NO_HANDLE);
  CHECK(ist_overlap(&s->a, &s->b, &s->workspace, NULL) == IST_NULL_POINTER);
  CHECK(ist_overlap(NULL, &s->b, &s->workspace, &answer) == IST_NULL_POINTER);
  CHECK(ist_overlap(&floor, &s->b, &s->workspace, NULL) == IST_NULL_POINTER);

  CHECK(ist_get_size_match(&s->a, &s->b, &fit) == IST_OK && fit.ratio >= 1 && fit.feature_size_a > 0);
  CHECK(ist_get_size_match(NULL, &s->b, &fit) == IST_NULL_POINTER);
  CHECK(is_empty(&fit, sizeof fit, IST_NULL_POINTER));
  CHECK(ist_get_size_match(&s->a, NULL, &fit) == IST_NULL_POINTER);
  CHECK(ist_get_size_match(&s->a, &s->b, NULL) == IST_NULL_POINTER);
  fit.size = 0;
  CHECK(ist_get_size_match(&s->a, &s->b, &fit) == IST_WRONG_SIZE);
  return 0;
}

int patches_answer(scene_t* s) {
  ist_contact_patch_t storage[8];
  ist_contact_patches_t patches = {.size = sizeof patches, .patch_size = sizeof storage[0]};
  ist_penetration_t whole = {.size = sizeof whole};
  ist_contact_settings_t settings = {.size = sizeof settings};
  ist_placed_t wrong = s->b;
  double volume = 0, left = 0;
  size_t i;
  patches.patches = storage;
  patches.capacity = 8;
  CHECK(ist_contact_patches(&s->a, &s->b, NULL, &s->workspace, &patches, &whole) == IST_OK);
  CHECK(patches.count > 0 && patches.count <= 8);
  for (i = 0; i < patches.count; ++i) volume += storage[i].volume;
  CHECK(fabs(volume - whole.volume) <= 1e-12 * whole.volume);
  CHECK(ist_contact_patches(&s->a, &s->b, &settings, &s->workspace, &patches, NULL) == IST_OK);
  CHECK(ist_contact_patches(NULL, &s->b, NULL, &s->workspace, &patches, &whole) ==
        IST_NULL_POINTER);
  CHECK(patches.count == 0 && is_refused(&whole, sizeof whole, IST_NULL_POINTER));
  CHECK(ist_contact_patches(&s->a, NULL, NULL, &s->workspace, &patches, NULL) == IST_NULL_POINTER);
  CHECK(ist_contact_patches(&s->a, &s->b, NULL, NULL, &patches, NULL) == IST_NULL_POINTER);
  CHECK(ist_contact_patches(&s->a, &s->b, NULL, &s->workspace, NULL, &whole) == IST_NULL_POINTER);

  /* Without protrusion: by lenses alone, where the faces hardly touch. */
  settings.spheres_only = 1;
  CHECK(ist_contact_patches(&s->a, &s->b, &settings, &s->workspace, &patches, NULL) == IST_OK);
  for (i = 0, volume = 0; i < patches.count; ++i) volume += storage[i].volume;
  CHECK(ist_patches_without_protrusion(&s->a, &s->b, &settings, &patches) == IST_OK);
  for (i = 0; i < patches.count; ++i) left += storage[i].volume;
  CHECK(left <= volume * (1 + 1e-12) && left >= 0);
  CHECK(ist_patches_without_protrusion(NULL, &s->b, &settings, &patches) == IST_NULL_POINTER);
  CHECK(ist_patches_without_protrusion(&s->a, NULL, NULL, &patches) == IST_NULL_POINTER);
  CHECK(ist_patches_without_protrusion(&s->a, &s->b, NULL, NULL) == IST_NULL_POINTER);
  wrong.pose.t[0] = NAN;
  CHECK(ist_patches_without_protrusion(&s->a, &wrong, NULL, &patches) == IST_INVALID_INPUT);
  settings.measure = 7;
  CHECK(ist_patches_without_protrusion(&s->a, &s->b, &settings, &patches) == IST_INVALID_INPUT);
  settings.measure = IST_MATCHED;
  patches.count = 9; /* more than there is room for */
  CHECK(ist_patches_without_protrusion(&s->a, &s->b, NULL, &patches) == IST_INVALID_INPUT);
  patches.count = 0;
  patches.patch_size = 8;
  CHECK(ist_patches_without_protrusion(&s->a, &s->b, NULL, &patches) == IST_WRONG_SIZE);
  patches.patch_size = sizeof storage[0];

  patches.patches = NULL;
  CHECK(ist_patches_without_protrusion(&s->a, &s->b, NULL, &patches) == IST_NULL_POINTER);
  CHECK(ist_contact_patches(&s->a, &s->b, NULL, &s->workspace, &patches, NULL) == IST_NULL_POINTER);
  patches.capacity = 0;
  CHECK(ist_contact_patches(&s->a, &s->b, NULL, &s->workspace, &patches, NULL) == IST_INVALID_INPUT);
  patches.patch_size = 0;
  CHECK(ist_contact_patches(&s->a, &s->b, NULL, &s->workspace, &patches, NULL) == IST_WRONG_SIZE);
  patches.patch_size = sizeof storage[0];
  settings.size = 1;
  CHECK(ist_contact_patches(&s->a, &s->b, &settings, &s->workspace, &patches, NULL) ==
        IST_WRONG_SIZE);
  whole.size = 1;
  CHECK(ist_contact_patches(&s->a, &s->b, NULL, &s->workspace, &patches, &whole) == IST_WRONG_SIZE);
  patches.size = 1;
  CHECK(ist_patches_without_protrusion(&s->a, &s->b, NULL, &patches) == IST_WRONG_SIZE);
  CHECK(ist_contact_patches(&s->a, &s->b, NULL, &s->workspace, &patches, NULL) == IST_WRONG_SIZE);
  return 0;
}

int outlines_answer(scene_t* s) {
  ist_contact_patch_t storage[4];
  ist_outline_segment_t segments[4];
  ist_contact_patches_t patches = {.size = sizeof patches, .patch_size = sizeof storage[0]};
  ist_outline_t outline = {.size = sizeof outline, .segment_size = sizeof segments[0]};
  ist_penetration_t whole = {.size = sizeof whole};
  ist_contact_settings_t settings = {.size = sizeof settings};
  ist_asset_info_t info = {.size = sizeof info};
  ist_placed_t wrong;
  ist_status_t wanted = IST_OK;
  patches.patches = storage;
  patches.capacity = 4;
  outline.segments = segments;
  outline.capacity = 4;
  CHECK(ist_asset_get_info(&s->tree_a, &info) == IST_OK);
  if (info.mesh_triangles == 0) wanted = IST_MISSING_DATA;
  CHECK(ist_asset_get_info(&s->tree_b, &info) == IST_OK);
  if (info.mesh_triangles == 0) wanted = IST_MISSING_DATA;
  outline.total = outline.count = patches.count = 9;
  CHECK(ist_overlap_outline(&s->a, &s->b, NULL, &s->workspace, &patches, &outline, &whole) ==
        wanted);
  CHECK(whole.status == wanted);
  CHECK(wanted == IST_OK || (isnan(whole.volume) && patches.count == 0 && outline.total == 0));
  CHECK(outline.count == (outline.total < 4 ? outline.total : 4));

  outline.total = outline.count = patches.count = 9;
  CHECK(ist_overlap_outline(NULL, &s->b, NULL, &s->workspace, &patches, &outline, &whole) ==
        IST_NULL_POINTER);
  CHECK(is_refused(&whole, sizeof whole, IST_NULL_POINTER));
  CHECK(patches.count == 0 && outline.total == 0 && outline.count == 0);
  CHECK(ist_overlap_outline(&s->a, NULL, NULL, &s->workspace, &patches, &outline, NULL) ==
        IST_NULL_POINTER);
  CHECK(ist_overlap_outline(&s->a, &s->b, NULL, NULL, &patches, &outline, NULL) ==
        IST_NULL_POINTER);
  CHECK(ist_overlap_outline(&s->a, &s->b, NULL, &s->workspace, NULL, &outline, NULL) ==
        IST_NULL_POINTER);
  patches.count = 9;
  CHECK(ist_overlap_outline(&s->a, &s->b, NULL, &s->workspace, &patches, NULL, &whole) ==
        IST_NULL_POINTER);
  CHECK(patches.count == 0 && is_refused(&whole, sizeof whole, IST_NULL_POINTER));
  wrong = s->b;
  wrong.pose.t[0] = NAN;
  CHECK(ist_overlap_outline(&s->a, &wrong, NULL, &s->workspace, &patches, &outline, NULL) ==
        IST_INVALID_INPUT);
  settings.measure = 7;
  CHECK(ist_overlap_outline(&s->a, &s->b, &settings, &s->workspace, &patches, &outline, NULL) ==
        IST_INVALID_INPUT);
  outline.segments = NULL;
  CHECK(ist_overlap_outline(&s->a, &s->b, NULL, &s->workspace, &patches, &outline, NULL) ==
        IST_NULL_POINTER);
  outline.capacity = 0;
  CHECK(ist_overlap_outline(&s->a, &s->b, NULL, &s->workspace, &patches, &outline, NULL) == wanted);
  outline.segment_size = 8;
  CHECK(ist_overlap_outline(&s->a, &s->b, NULL, &s->workspace, &patches, &outline, NULL) ==
        IST_WRONG_SIZE);
  outline.size = 8;
  CHECK(ist_overlap_outline(&s->a, &s->b, NULL, &s->workspace, &patches, &outline, NULL) ==
        IST_WRONG_SIZE);
  return 0;
}

/* --- Fields ----------------------------------------------------------------------------------- */

/* The half-space z ≤ offset, as a function. */
static void sample(const void* context, const double x[3], ist_shape_sample_t* answer) {
  answer->distance = x[2] - *(const double*)context;
  answer->gradient[2] = 1;
}

int fields_answer(scene_t* s) {
  static float heights[125], distances[125];
  static const double offset = 0.1;
  const ist_pose_t identity = IST_POSE_IDENTITY;
  ist_shape_t field = {.size = sizeof field};
  ist_placed_t a = {.size = sizeof a};
  ist_penetration_t answer = {.size = sizeof answer}, again = {.size = sizeof again};
  ist_separation_t gap = {.size = sizeof gap};
  ist_contact_patch_t storage[4];
  ist_contact_patches_t patches = {.size = sizeof patches, .patch_size = sizeof storage[0]};
  double by_plane = 0;
  int kind, i;
  a.shape = &field;
  a.pose = identity;
  patches.patches = storage;
  patches.capacity = 4;
  for (i = 0; i < 125; ++i) distances[i] = -(heights[i] = 0.1f);
  for (kind = IST_HALF_SPACE; kind <= IST_FUNCTION; ++kind) {
    memset(&field.as, 0, sizeof field.as);
    field.kind = kind;
    if (kind == IST_HALF_SPACE) {
      field.as.half_space.normal[2] = 1;
      field.as.half_space.offset = offset;
    } else if (kind == IST_BOX) {
      for (i = 0; i < 3; ++i) field.as.box.half_extents[i] = 0.4;
    } else if (kind == IST_BALL) {
      field.as.ball.radius = 0.4;
    } else if (kind == IST_CAPSULE || kind == IST_CYLINDER) {
      field.as.capsule.radius = field.as.capsule.half_height = 0.4;
    } else if (kind == IST_HEIGHTS) {
      field.as.heights.heights = heights;
      field.as.heights.columns = field.as.heights.rows = 5;
      field.as.heights.spacing[0] = field.as.heights.spacing[1] = 0.3;
    } else if (kind == IST_DISTANCE_GRID) {
      field.as.distance_grid.distances = distances;
      for (i = 0; i < 3; ++i) field.as.distance_grid.points[i] = 5;
      for (i = 0; i < 3; ++i) field.as.distance_grid.origin[i] = -1;
      field.as.distance_grid.spacing = 0.5;
    } else {
      field.as.function.sample = sample;
      field.as.function.context = &offset;
    }
    CHECK(ist_penetration(&a, &s->b, NULL, &s->workspace, &answer) == IST_OK);
    CHECK(answer.volume > 0);
    CHECK(ist_query(&a, &s->b, NULL, NULL, &s->workspace, &again, &gap) == IST_OK);
    CHECK(memcmp(&answer, &again, sizeof answer) == 0 && gap.distance == 0);
    CHECK(ist_contact_patches(&a, &s->b, NULL, &s->workspace, &patches, &again) == IST_OK);
    CHECK(patches.count > 0 && again.volume == answer.volume);
    if (kind == IST_HALF_SPACE || kind == IST_HEIGHTS) {
      if (kind == IST_HALF_SPACE) by_plane = answer.volume;
      CHECK(fabs(answer.volume - by_plane) <= 1e-6 * by_plane);
    }
    s->b.pose.t[2] = 20;
    if (kind != IST_DISTANCE_GRID) {
      CHECK(ist_separation(&a, &s->b, NULL, &s->workspace, &gap) == IST_OK);
      CHECK(gap.distance > 10);
    }
    s->b.pose.t[2] = 0;
  }

  /* What they point to, null. */
  memset(&field.as, 0, sizeof field.as);
  for (kind = IST_HEIGHTS; kind <= IST_FUNCTION; ++kind) {
    field.kind = kind;
    CHECK(ist_penetration(&a, &s->b, NULL, &s->workspace, &answer) == IST_NULL_POINTER);
    CHECK(is_refused(&answer, sizeof answer, IST_NULL_POINTER));
  }
  memset(&field.as, 0, sizeof field.as);
  for (kind = IST_HALF_SPACE; kind <= IST_CYLINDER; ++kind) { /* no length may be 0 */
    field.kind = kind;
    CHECK(ist_penetration(&a, &s->b, NULL, &s->workspace, &answer) == IST_INVALID_INPUT);
  }
  field.kind = 0;
  CHECK(ist_penetration(&a, &s->b, NULL, &s->workspace, &answer) == IST_INVALID_INPUT);
  field.kind = 99;
  CHECK(ist_penetration(&a, &s->b, NULL, &s->workspace, &answer) == IST_INVALID_INPUT);
  field.size = 8;
  CHECK(ist_penetration(&a, &s->b, NULL, &s->workspace, &answer) == IST_WRONG_SIZE);
  a.shape = NULL;
  CHECK(ist_penetration(&a, &s->b, NULL, &s->workspace, &answer) == IST_NULL_POINTER);
  a.size = 8;
  CHECK(ist_penetration(&a, &s->b, NULL, &s->workspace, &answer) == IST_WRONG_SIZE);
  CHECK(ist_penetration(NULL, &s->b, NULL, &s->workspace, &answer) == IST_NULL_POINTER);
  CHECK(ist_separation(NULL, &s->b, NULL, &s->workspace, &gap) == IST_NULL_POINTER);
  CHECK(ist_query(NULL, &s->b, NULL, NULL, &s->workspace, &answer, &gap) == IST_NULL_POINTER);
  CHECK(ist_contact_patches(NULL, &s->b, NULL, &s->workspace, &patches, NULL) == IST_NULL_POINTER);

  /* Either may be the second; not both, nor both in one; and some functions want assets. */
  field.size = sizeof field;
  field.kind = IST_BALL;
  field.as.ball.radius = 0.4;
  a.shape = &field;
  a.size = sizeof a;
  CHECK(ist_penetration(&a, &s->b, NULL, &s->workspace, &answer) == IST_OK);
  CHECK(ist_penetration(&s->b, &a, NULL, &s->workspace, &again) == IST_OK);
  CHECK(answer.volume == again.volume);
  for (i = 0; i < 3; ++i) CHECK(answer.force[i] == -again.force[i]);
  CHECK(ist_penetration(&a, &a, NULL, &s->workspace, &answer) == IST_MISSING_DATA);
  CHECK(ist_without_protrusion(&again, &s->b, &a, &answer) == IST_MISSING_DATA);
  CHECK(is_refused(&answer, sizeof answer, IST_MISSING_DATA));
  a.asset = &s->tree_a;
  CHECK(ist_penetration(&a, &s->b, NULL, &s->workspace, &answer) == IST_INVALID_INPUT);
  return 0;
}
