/* What an asset holds, and lenses. */
#include <math.h>
#include <stdlib.h>

#include "scene.h"

static double distance(const double a[3], const double b[3]) {
  return hypot(hypot(a[0] - b[0], a[1] - b[1]), a[2] - b[2]);
}

/* `set.level` of a tree holds every sphere of it. */
static int level_holds_the_spheres(const ist_asset_t* tree, ist_ball_set_t set, size_t below) {
  size_t sphere_count, count, i, k;
  ist_ball_t *balls, *spheres;
  CHECK(ist_asset_get_balls(tree, &set, NULL, 0, &count) == IST_OK);
  CHECK(count == (below + 15) / 16);
  balls = malloc(count * sizeof *balls);
  CHECK(balls != NULL);
  CHECK(ist_asset_get_balls(tree, &set, balls, count, &count) == IST_OK);
  set.level = 0;
  CHECK(ist_asset_get_balls(tree, &set, NULL, 0, &sphere_count) == IST_OK);
  spheres = malloc(sphere_count * sizeof *spheres);
  CHECK(spheres != NULL);
  CHECK(ist_asset_get_balls(tree, &set, spheres, sphere_count, &sphere_count) == IST_OK);
  for (i = 0; i < sphere_count; ++i) {
    int held = 0;
    for (k = 0; k < count && !held; ++k)
      held = distance(spheres[i].centre, balls[k].centre) + spheres[i].radius <=
             balls[k].radius * (1 + 1e-6);
    CHECK(held);
  }
  free(balls);
  free(spheres);
  return 0;
}

static int levels_hold_the_spheres(const ist_asset_t* tree, ist_ball_set_t set) {
  size_t count, below;
  CHECK(ist_asset_get_balls(tree, &set, NULL, 0, &below) == IST_OK);
  for (set.level = 1; ist_asset_get_balls(tree, &set, NULL, 0, &count) == IST_OK; ++set.level) {
    CHECK(level_holds_the_spheres(tree, set, below) == 0);
    below = count;
  }
  CHECK(ist_asset_get_balls(tree, &set, NULL, 0, &count) == IST_INVALID_INPUT && count == 0);
  CHECK(below >= 1 && below <= 16);
  return 0;
}

int balls_are_told(scene_t* s) {
  ist_asset_info_t info = {.size = sizeof info};
  ist_ball_set_t set = {.size = sizeof set};
  ist_ball_t two[2], guard = {{7, 7, 7}, 7};
  size_t count = 1;
  const ist_asset_t empty = {0};
  CHECK(ist_asset_get_info(&s->tree_b, &info) == IST_OK && info.details >= 1);
  CHECK(ist_asset_get_balls(&s->tree_b, &set, NULL, 0, &count) == IST_OK && count == info.spheres);
  two[1] = guard;
  CHECK(ist_asset_get_balls(&s->tree_b, &set, two, 1, &count) == IST_OK && count == info.spheres);
  CHECK(two[0].radius > 0 && memcmp(&two[1], &guard, sizeof guard) == 0);
  CHECK(levels_hold_the_spheres(&s->tree_b, set) == 0);
  for (set.detail = 1; set.detail < info.details; ++set.detail) {
    CHECK(ist_asset_get_balls(&s->tree_b, &set, NULL, 0, &count) == IST_OK);
    CHECK(count == info.spheres >> (2 * set.detail));
    CHECK(levels_hold_the_spheres(&s->tree_b, set) == 0);
  }
  CHECK(ist_asset_get_balls(&s->tree_b, &set, two, 2, &count) == IST_INVALID_INPUT && count == 0);
  set.detail = 0;
  set.measure = IST_INNER;
  CHECK(levels_hold_the_spheres(&s->tree_b, set) == 0);
  set.detail = 1; /* inner spheres have one level of detail */
  CHECK(ist_asset_get_balls(&s->tree_b, &set, NULL, 0, &count) == IST_INVALID_INPUT);
  set.detail = 0;
  set.measure = 2;
  CHECK(ist_asset_get_balls(&s->tree_b, &set, NULL, 0, &count) == IST_INVALID_INPUT);
  set.measure = -1;
  CHECK(ist_asset_get_balls(&s->tree_b, &set, NULL, 0, &count) == IST_INVALID_INPUT);
  set.measure = IST_MATCHED;
  CHECK(ist_asset_get_balls(NULL, &set, NULL, 0, &count) == IST_NULL_POINTER);
  CHECK(ist_asset_get_balls(&empty, &set, NULL, 0, &count) == IST_NO_HANDLE);
  CHECK(ist_asset_get_balls(&s->tree_b, NULL, NULL, 0, &count) == IST_NULL_POINTER);
  CHECK(ist_asset_get_balls(&s->tree_b, &set, NULL, 1, &count) == IST_NULL_POINTER);
  CHECK(ist_asset_get_balls(&s->tree_b, &set, NULL, 0, NULL) == IST_NULL_POINTER);
  set.size = 0;
  CHECK(ist_asset_get_balls(&s->tree_b, &set, NULL, 0, &count) == IST_WRONG_SIZE);
  return 0;
}

/* Six times the volume in a closed surface. */
static double volume_times_six(const ist_mesh_t* surface) {
  double sum = 0;
  size_t i;
  for (i = 0; i < surface->triangle_count; ++i) {
    const double* a = surface->vertices[surface->triangles[i][0]];
    const double* b = surface->vertices[surface->triangles[i][1]];
    const double* c = surface->vertices[surface->triangles[i][2]];
    sum += a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
           a[2] * (b[0] * c[1] - b[1] * c[0]);
  }
  return sum;
}

int surfaces_are_told(scene_t* s) {
  ist_asset_info_t info = {.size = sizeof info};
  ist_mesh_t surface = {.size = sizeof surface};
  double one_vertex[2][3] = {{0, 0, 0}, {7, 7, 7}};
  const ist_asset_t empty = {0};
  const ist_asset_t* tree = &s->tree_a;
  CHECK(ist_asset_get_info(tree, &info) == IST_OK);
  CHECK(ist_asset_get_mesh(tree, &surface) == IST_OK);
  CHECK(surface.triangle_count == info.mesh_triangles);
  if (info.mesh_triangles > 0) {
    surface.vertices = one_vertex;
    surface.vertex_capacity = 1;
    CHECK(ist_asset_get_mesh(tree, &surface) == IST_OK);
    CHECK(surface.vertex_count > 1 && one_vertex[0][0] != 0 && one_vertex[1][0] == 7);
    surface.vertex_capacity = surface.vertex_count;
    surface.triangle_capacity = surface.triangle_count;
    surface.vertices = malloc(surface.vertex_capacity * sizeof surface.vertices[0]);
    surface.triangles = malloc(surface.triangle_capacity * sizeof surface.triangles[0]);
    CHECK(surface.vertices != NULL && surface.triangles != NULL);
    CHECK(ist_asset_get_mesh(tree, &surface) == IST_OK);
    CHECK(fabs(volume_times_six(&surface) - 6 * info.volume) <= 1e-12 * info.volume);
    free(surface.vertices);
    free(surface.triangles);
  } else {
    CHECK(surface.vertex_count == 0);
  }
  surface.vertices = NULL;
  CHECK(ist_asset_get_mesh(&empty, &surface) ==
        (surface.vertex_capacity > 0 ? IST_NULL_POINTER : IST_NO_HANDLE));
  surface.vertex_capacity = surface.triangle_capacity = 0;
  CHECK(ist_asset_get_mesh(&empty, &surface) == IST_NO_HANDLE && surface.vertex_count == 0);
  CHECK(ist_asset_get_mesh(NULL, &surface) == IST_NULL_POINTER);
  surface.triangle_capacity = 1;
  surface.triangles = NULL;
  CHECK(ist_asset_get_mesh(tree, &surface) == IST_NULL_POINTER);
  CHECK(ist_asset_get_mesh(tree, NULL) == IST_NULL_POINTER);
  surface.size = 0;
  CHECK(ist_asset_get_mesh(tree, &surface) == IST_WRONG_SIZE);
  return 0;
}

int lenses_are_told(scene_t* s) {
  ist_lens_settings_t settings = {.size = sizeof settings};
  ist_lens_t storage[3];
  ist_lenses_t lenses = {.size = sizeof lenses, .lens_size = sizeof storage[0]};
  ist_placed_t far_away = s->b, wrong = s->b;
  size_t total, i;
  memset(storage, 0, sizeof storage);
  CHECK(ist_overlap_lenses(&s->a, &s->b, NULL, &lenses) == IST_OK);
  CHECK(lenses.total > 3 && lenses.count == 0);
  total = lenses.total;
  lenses.lenses = storage;
  lenses.capacity = 2;
  CHECK(ist_overlap_lenses(&s->a, &s->b, &settings, &lenses) == IST_OK);
  CHECK(lenses.total == total && lenses.count == 2 && storage[2].radius == 0);
  for (i = 0; i < 2; ++i) {
    CHECK(storage[i].radius > 0 && storage[i].thickness > 0);
    CHECK(fabs(hypot(hypot(storage[i].axis[0], storage[i].axis[1]), storage[i].axis[2]) - 1) <=
          1e-12);
  }
  settings.measure = IST_INNER;
  CHECK(ist_overlap_lenses(&s->a, &s->b, &settings, &lenses) == IST_OK);
  CHECK(lenses.total > 0 && lenses.total != total);
  settings.detail_a = 1;
  CHECK(ist_overlap_lenses(&s->a, &s->b, &settings, &lenses) == IST_INVALID_INPUT);
  CHECK(lenses.total == 0 && lenses.count == 0);
  settings.measure = IST_MATCHED;
  settings.detail_a = 99;
  CHECK(ist_overlap_lenses(&s->a, &s->b, &settings, &lenses) == IST_INVALID_INPUT);
  settings.detail_a = 0;
  settings.measure = 2;
  CHECK(ist_overlap_lenses(&s->a, &s->b, &settings, &lenses) == IST_INVALID_INPUT);
  far_away.pose.t[0] = 100;
  CHECK(ist_overlap_lenses(&s->a, &far_away, NULL, &lenses) == IST_OK && lenses.total == 0);
  wrong.pose.q[0] = 0;
  CHECK(ist_overlap_lenses(&s->a, &wrong, NULL, &lenses) == IST_INVALID_INPUT);
  CHECK(ist_overlap_lenses(NULL, &s->b, NULL, &lenses) == IST_NULL_POINTER);
  CHECK(ist_overlap_lenses(&s->a, NULL, NULL, &lenses) == IST_NULL_POINTER);
  CHECK(ist_overlap_lenses(&s->a, &s->b, NULL, NULL) == IST_NULL_POINTER);
  lenses.lenses = NULL;
  CHECK(ist_overlap_lenses(&s->a, &s->b, NULL, &lenses) == IST_NULL_POINTER);
  lenses.lens_size = 1;
  CHECK(ist_overlap_lenses(&s->a, &s->b, NULL, &lenses) == IST_WRONG_SIZE);
  settings.size = lenses.size = 0;
  CHECK(ist_overlap_lenses(&s->a, &s->b, NULL, &lenses) == IST_WRONG_SIZE);
  lenses.size = sizeof lenses;
  lenses.lens_size = sizeof storage[0];
  lenses.lenses = storage;
  CHECK(ist_overlap_lenses(&s->a, &s->b, &settings, &lenses) == IST_WRONG_SIZE);
  return 0;
}
