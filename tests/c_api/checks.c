/* Every function of ist/ist.h from C11, right and wrong: checks A.ist B.ist
 * Exits 0, or 1 at the first thing that is not as the header says, which it names. */
#include "checks.h"

#include <ist/ist.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define CHECK(condition)                                              \
  do {                                                                \
    if (!(condition)) {                                               \
      fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition); \
      return 1;                                                       \
    }                                                                 \
  } while (0)

/* All zero but the size and the status. */
static int is_empty(const void* answer, size_t size, ist_status_t status) {
  const unsigned char* bytes = (const unsigned char*)answer;
  uint32_t own_size = 0;
  ist_status_t own_status = 0;
  size_t i = 2 * sizeof(uint32_t);
  memcpy(&own_size, bytes, sizeof own_size);
  memcpy(&own_status, bytes + sizeof own_size, sizeof own_status);
  for (; i < size; ++i)
    if (bytes[i] != 0) return 0;
  return own_size == size && own_status == status;
}

/* --- Memory that is counted, and that runs out ------------------------------------------------ */

typedef struct counted {
  size_t taken, given_back, blocks, blocks_left;
  int misaligned;
} counted_t;

static void* take(void* context, size_t bytes, size_t alignment) {
  counted_t* counted = (counted_t*)context;
  void* memory;
  if (counted->blocks_left == 0 || bytes > (size_t)1 << 40) return NULL;
  --counted->blocks_left;
  memory = aligned_alloc(alignment < sizeof(void*) ? sizeof(void*) : alignment,
                         (bytes + 4095) / 4096 * 4096);
  counted->taken += bytes;
  ++counted->blocks;
  return memory;
}

static void give_back(void* context, void* memory, size_t bytes, size_t alignment) {
  counted_t* counted = (counted_t*)context;
  if ((uintptr_t)memory % alignment != 0) counted->misaligned = 1;
  counted->given_back += bytes;
  free(memory);
}

static int memory_is_the_callers(const char* path) {
  counted_t counted = {0};
  ist_allocator_t allocator = {.size = sizeof allocator, .allocate = take, .release = give_back};
  ist_tree_t tree = {0};
  ist_workspace_t workspace = {0};
  size_t left, needed;
  allocator.context = &counted;
  counted.blocks_left = 1000;
  CHECK(ist_tree_load(path, &allocator, &tree) == IST_OK);
  CHECK(counted.blocks == 1);
  CHECK(ist_workspace_make(1000, &allocator, &workspace) == IST_OK);
  CHECK(counted.blocks > 1);
  CHECK(ist_tree_release(&tree) == IST_OK);
  CHECK(ist_workspace_release(&workspace) == IST_OK);
  CHECK(counted.taken == counted.given_back && !counted.misaligned);

  needed = counted.blocks - 1;            /* by the workspace */
  for (left = 0; left < needed; ++left) { /* whichever block is the one too many */
    counted.blocks_left = left;
    CHECK(ist_workspace_make(1000, &allocator, &workspace) == IST_NO_MEMORY);
    CHECK(counted.taken == counted.given_back);
    CHECK(ist_workspace_release(&workspace) == IST_NO_HANDLE);
  }
  counted.blocks_left = 0;
  CHECK(ist_tree_load(path, &allocator, &tree) == IST_NO_MEMORY);
  CHECK(ist_tree_release(&tree) == IST_NO_HANDLE);
  CHECK(ist_workspace_make(SIZE_MAX, NULL, &workspace) == IST_NO_MEMORY);
  counted.blocks_left = 1000;
  CHECK(ist_workspace_make(SIZE_MAX / 16, &allocator, &workspace) == IST_NO_MEMORY);
  CHECK(counted.taken == counted.given_back);

  allocator.release = NULL;
  CHECK(ist_tree_load(path, &allocator, &tree) == IST_NULL_POINTER);
  CHECK(ist_workspace_make(0, &allocator, &workspace) == IST_NULL_POINTER);
  allocator.release = give_back;
  allocator.size = 0;
  CHECK(ist_tree_load(path, &allocator, &tree) == IST_WRONG_SIZE);
  CHECK(ist_workspace_make(0, &allocator, &workspace) == IST_WRONG_SIZE);
  return 0;
}

/* --- Trees ------------------------------------------------------------------------------------ */

static int trees_are_checked(const char* path) {
  ist_tree_t tree = {0}, copy;
  ist_tree_info_t info = {.size = sizeof info};
  char* block;
  char* bytes;
  size_t size;
  FILE* file = fopen(path, "rb");
  CHECK(file != NULL);
  block = malloc(1 << 24);
  CHECK(block != NULL);
  bytes = block + (64 - (uintptr_t)block % 64) % 64;
  size = fread(bytes, 1, (1 << 24) - 64, file);
  fclose(file);

  CHECK(ist_tree_view(bytes, size, &tree) == IST_OK);
  CHECK(ist_tree_get_info(&tree, &info) == IST_OK);
  CHECK(info.spheres > 0 && info.volume > 0 && info.coverage >= 0 && info.coverage <= 1);
  CHECK(info.has_field == (info.field_triangles > 0));
  copy = tree; /* it owns nothing */
  CHECK(ist_tree_release(&copy) == IST_OK && ist_tree_release(&copy) == IST_NO_HANDLE);
  CHECK(ist_tree_get_info(&copy, &info) == IST_NO_HANDLE && info.spheres == 0);
  CHECK(ist_tree_get_info(&tree, &info) == IST_OK);
  CHECK(ist_tree_get_info(NULL, &info) == IST_NULL_POINTER);
  CHECK(ist_tree_get_info(&tree, NULL) == IST_NULL_POINTER);
  info.size = 1;
  CHECK(ist_tree_get_info(&tree, &info) == IST_WRONG_SIZE);
  memset(&copy, 0xab, sizeof copy); /* never made */
  info.size = sizeof info;
  CHECK(ist_tree_get_info(&copy, &info) == IST_NO_HANDLE);
  CHECK(ist_tree_release(&copy) == IST_NO_HANDLE);

  CHECK(ist_tree_view(NULL, size, &tree) == IST_NULL_POINTER);
  CHECK(ist_tree_release(&tree) == IST_NO_HANDLE); /* a failure leaves it empty */
  CHECK(ist_tree_view(bytes, size, NULL) == IST_NULL_POINTER);
  CHECK(ist_tree_view(bytes + 1, size - 1, &tree) == IST_MISALIGNED);
  CHECK(ist_tree_view(bytes, 4, &tree) == IST_TOO_SHORT);
  CHECK(ist_tree_view(bytes, 0, &tree) == IST_TOO_SHORT);
  CHECK(ist_tree_view(bytes, size - 1, &tree) == IST_TOO_SHORT);
  CHECK(ist_tree_view(bytes, size + 1, &tree) == IST_CORRUPT_LAYOUT);
  bytes[size / 2] = (char)(bytes[size / 2] ^ 1);
  CHECK(ist_tree_view(bytes, size, &tree) == IST_CORRUPT_HASH);
  bytes[8] = (char)(bytes[8] ^ 64);
  CHECK(ist_tree_view(bytes, size, &tree) == IST_OTHER_FORMAT);
  bytes[0] = 'X';
  CHECK(ist_tree_view(bytes, size, &tree) == IST_NOT_AN_ASSET);
  CHECK(ist_tree_release(NULL) == IST_NULL_POINTER);
  free(block);

  CHECK(ist_tree_load(NULL, NULL, &tree) == IST_NULL_POINTER);
  CHECK(ist_tree_load(path, NULL, NULL) == IST_NULL_POINTER);
  CHECK(ist_tree_load("/nowhere/at/all.ist", NULL, &tree) == IST_CANNOT_READ);
  CHECK(ist_tree_load("/", NULL, &tree) == IST_CANNOT_READ);
  CHECK(ist_tree_load("/dev/null", NULL, &tree) < 0);
  CHECK(ist_tree_release(&tree) == IST_NO_HANDLE);
  return 0;
}

/* --- Queries ---------------------------------------------------------------------------------- */

typedef struct scene {
  ist_tree_t tree_a, tree_b;
  ist_placed_tree_t a, b;
  ist_workspace_t workspace;
} scene_t;

static int make_scene(scene_t* scene, const char* path_a, const char* path_b) {
  const ist_pose_t identity = IST_POSE_IDENTITY;
  memset(scene, 0, sizeof *scene);
  CHECK(ist_tree_load(path_a, NULL, &scene->tree_a) == IST_OK);
  CHECK(ist_tree_load(path_b, NULL, &scene->tree_b) == IST_OK);
  CHECK(ist_workspace_make(1 << 16, NULL, &scene->workspace) == IST_OK);
  scene->a.size = scene->b.size = sizeof scene->a;
  scene->a.tree = &scene->tree_a;
  scene->b.tree = &scene->tree_b;
  scene->a.pose = scene->b.pose = identity;
  scene->b.pose.t[0] = 0.25;
  return 0;
}

static int penetrations_answer(scene_t* s) {
  ist_penetration_t whole = {.size = sizeof whole}, other = {.size = sizeof other};
  ist_penetration_settings_t settings = {.size = sizeof settings};
  ist_placed_tree_t wrong;
  const ist_tree_t empty = {0};
  ist_workspace_t none = {0};

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
  CHECK(is_empty(&other, sizeof other, IST_NULL_POINTER));
  CHECK(ist_penetration(&s->a, NULL, NULL, &s->workspace, &other) == IST_NULL_POINTER);
  CHECK(ist_penetration(&s->a, &s->b, NULL, NULL, &other) == IST_NULL_POINTER);
  CHECK(ist_penetration(&s->a, &s->b, NULL, &s->workspace, NULL) == IST_NULL_POINTER);
  wrong = s->a;
  wrong.tree = NULL;
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
  wrong.tree = &empty;
  CHECK(ist_penetration(&wrong, &s->b, NULL, &s->workspace, &other) == IST_NO_HANDLE);
  CHECK(is_empty(&other, sizeof other, IST_NO_HANDLE));
  CHECK(ist_penetration(&s->a, &wrong, NULL, &s->workspace, &other) == IST_NO_HANDLE);
  CHECK(ist_penetration(&s->a, &s->b, NULL, &none, &other) == IST_NO_HANDLE);

  /* Numbers that are none. */
  settings.measure = 2;
  CHECK(ist_penetration(&s->a, &s->b, &settings, &s->workspace, &other) == IST_INVALID_INPUT);
  settings.measure = IST_MATCHED;
  settings.field = -1;
  CHECK(ist_penetration(&s->a, &s->b, &settings, &s->workspace, &other) == IST_INVALID_INPUT);
  wrong = s->a;
  wrong.pose.t[1] = NAN;
  CHECK(ist_penetration(&wrong, &s->b, NULL, &s->workspace, &other) == IST_INVALID_INPUT);
  CHECK(is_empty(&other, sizeof other, IST_INVALID_INPUT));
  wrong = s->a;
  wrong.scale = -1;
  CHECK(ist_penetration(&wrong, &s->b, NULL, &s->workspace, &other) == IST_INVALID_INPUT);

  settings.field = IST_FIELD_NEVER;
  settings.max_visits = 0;
  CHECK(ist_penetration(&s->a, &s->b, &settings, &s->workspace, &whole) == IST_OK);
  CHECK(ist_without_protrusion(&whole, &s->a, &s->b, &other) == IST_OK);
  CHECK(other.volume <= whole.volume);
  CHECK(ist_without_protrusion(NULL, &s->a, &s->b, &other) == IST_NULL_POINTER);
  CHECK(ist_without_protrusion(&whole, NULL, &s->b, &other) == IST_NULL_POINTER);
  CHECK(ist_without_protrusion(&whole, &s->a, NULL, &other) == IST_NULL_POINTER);
  CHECK(is_empty(&other, sizeof other, IST_NULL_POINTER));
  CHECK(ist_without_protrusion(&whole, &s->a, &s->b, NULL) == IST_NULL_POINTER);
  CHECK(ist_without_protrusion(&whole, &s->a, &s->b, &whole) == IST_OK); /* in its place */
  return 0;
}

static int separations_answer(scene_t* s) {
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
  settings.max_visits = 1;
  CHECK(ist_separation(&s->a, &s->b, &settings, &s->workspace, &gap) == IST_BUDGET_EXHAUSTED);
  CHECK(ist_query(&s->a, &s->b, NULL, &settings, &s->workspace, &penetration, &separation) ==
        IST_BUDGET_EXHAUSTED);
  CHECK(penetration.status == IST_OK && separation.status == IST_BUDGET_EXHAUSTED);

  CHECK(ist_separation(NULL, &s->b, NULL, &s->workspace, &gap) == IST_NULL_POINTER);
  CHECK(is_empty(&gap, sizeof gap, IST_NULL_POINTER));
  CHECK(ist_separation(&s->a, NULL, NULL, &s->workspace, &gap) == IST_NULL_POINTER);
  CHECK(ist_separation(&s->a, &s->b, NULL, NULL, &gap) == IST_NULL_POINTER);
  CHECK(ist_separation(&s->a, &s->b, NULL, &s->workspace, NULL) == IST_NULL_POINTER);
  settings.size = 0;
  CHECK(ist_separation(&s->a, &s->b, &settings, &s->workspace, &gap) == IST_WRONG_SIZE);
  CHECK(ist_query(&s->a, &s->b, NULL, &settings, &s->workspace, &penetration, &separation) ==
        IST_WRONG_SIZE);
  CHECK(is_empty(&penetration, sizeof penetration, IST_WRONG_SIZE));
  CHECK(ist_query(NULL, &s->b, NULL, NULL, &s->workspace, &penetration, &separation) ==
        IST_NULL_POINTER);
  CHECK(ist_query(&s->a, NULL, NULL, NULL, &s->workspace, &penetration, &separation) ==
        IST_NULL_POINTER);
  CHECK(ist_query(&s->a, &s->b, NULL, NULL, NULL, &penetration, &separation) == IST_NULL_POINTER);
  CHECK(ist_query(&s->a, &s->b, NULL, NULL, &s->workspace, NULL, &separation) == IST_NULL_POINTER);
  CHECK(is_empty(&separation, sizeof separation, IST_NULL_POINTER));
  CHECK(ist_query(&s->a, &s->b, NULL, NULL, &s->workspace, &penetration, NULL) == IST_NULL_POINTER);
  CHECK(is_empty(&penetration, sizeof penetration, IST_NULL_POINTER));
  s->b.pose.t[0] = x;
  return 0;
}

static int overlaps_answer(scene_t* s) {
  ist_overlapping_t answer = 77;
  ist_pair_fit_t fit = {.size = sizeof fit};
  ist_field_t field = {.size = sizeof field, .kind = IST_HALF_SPACE};
  ist_placed_field_t floor = {.size = sizeof floor, .field = &field, .pose = s->a.pose};
  ist_placed_tree_t far_away = s->b;
  ist_workspace_t none = {0};
  field.as.half_space.normal[0] = 1;
  far_away.pose.t[0] = 20;
  CHECK(ist_overlap(&s->a, &s->b, &s->workspace, &answer) == IST_OK && answer == IST_OVERLAP_YES);
  CHECK(ist_overlap(&s->a, &far_away, &s->workspace, &answer) == IST_OK);
  CHECK(answer == IST_OVERLAP_NO);
  CHECK(ist_field_overlap(&floor, &s->b, &s->workspace, &answer) == IST_OK);
  CHECK(answer == IST_OVERLAP_YES);
  CHECK(ist_field_overlap(&floor, &far_away, &s->workspace, &answer) == IST_OK);
  CHECK(answer == IST_OVERLAP_NO);
  CHECK(ist_overlap(NULL, &s->b, &s->workspace, &answer) == IST_NULL_POINTER);
  CHECK(answer == IST_OVERLAP_UNKNOWN);
  CHECK(ist_overlap(&s->a, NULL, &s->workspace, &answer) == IST_NULL_POINTER);
  CHECK(ist_overlap(&s->a, &s->b, NULL, &answer) == IST_NULL_POINTER);
  CHECK(ist_overlap(&s->a, &s->b, &none, &answer) == IST_NO_HANDLE);
  CHECK(ist_overlap(&s->a, &s->b, &s->workspace, NULL) == IST_NULL_POINTER);
  CHECK(ist_field_overlap(NULL, &s->b, &s->workspace, &answer) == IST_NULL_POINTER);
  CHECK(ist_field_overlap(&floor, &s->b, &s->workspace, NULL) == IST_NULL_POINTER);

  CHECK(ist_get_pair_fit(&s->a, &s->b, &fit) == IST_OK && fit.ratio >= 1 && fit.grain_a > 0);
  CHECK(ist_get_pair_fit(NULL, &s->b, &fit) == IST_NULL_POINTER);
  CHECK(is_empty(&fit, sizeof fit, IST_NULL_POINTER));
  CHECK(ist_get_pair_fit(&s->a, NULL, &fit) == IST_NULL_POINTER);
  CHECK(ist_get_pair_fit(&s->a, &s->b, NULL) == IST_NULL_POINTER);
  fit.size = 0;
  CHECK(ist_get_pair_fit(&s->a, &s->b, &fit) == IST_WRONG_SIZE);
  return 0;
}

static int patches_answer(scene_t* s) {
  ist_contact_patch_t room[8];
  ist_contact_patches_t patches = {.size = sizeof patches, .patch_size = sizeof room[0]};
  ist_penetration_t whole = {.size = sizeof whole};
  ist_contact_settings_t settings = {.size = sizeof settings};
  double volume = 0;
  size_t i;
  patches.patches = room;
  patches.capacity = 8;
  CHECK(ist_contact_patches(&s->a, &s->b, NULL, &s->workspace, &patches, &whole) == IST_OK);
  CHECK(patches.count > 0 && patches.count <= 8);
  for (i = 0; i < patches.count; ++i) volume += room[i].volume;
  CHECK(fabs(volume - whole.volume) <= 1e-12 * whole.volume);
  CHECK(ist_contact_patches(&s->a, &s->b, &settings, &s->workspace, &patches, NULL) == IST_OK);
  CHECK(ist_contact_patches(NULL, &s->b, NULL, &s->workspace, &patches, &whole) ==
        IST_NULL_POINTER);
  CHECK(patches.count == 0 && is_empty(&whole, sizeof whole, IST_NULL_POINTER));
  CHECK(ist_contact_patches(&s->a, NULL, NULL, &s->workspace, &patches, NULL) == IST_NULL_POINTER);
  CHECK(ist_contact_patches(&s->a, &s->b, NULL, NULL, &patches, NULL) == IST_NULL_POINTER);
  CHECK(ist_contact_patches(&s->a, &s->b, NULL, &s->workspace, NULL, &whole) == IST_NULL_POINTER);
  patches.patches = NULL;
  CHECK(ist_contact_patches(&s->a, &s->b, NULL, &s->workspace, &patches, NULL) == IST_NULL_POINTER);
  patches.capacity = 0;
  CHECK(ist_contact_patches(&s->a, &s->b, NULL, &s->workspace, &patches, NULL) == IST_OK);
  patches.patch_size = 0;
  CHECK(ist_contact_patches(&s->a, &s->b, NULL, &s->workspace, &patches, NULL) == IST_WRONG_SIZE);
  patches.patch_size = sizeof room[0];
  settings.size = 1;
  CHECK(ist_contact_patches(&s->a, &s->b, &settings, &s->workspace, &patches, NULL) ==
        IST_WRONG_SIZE);
  whole.size = 1;
  CHECK(ist_contact_patches(&s->a, &s->b, NULL, &s->workspace, &patches, &whole) == IST_WRONG_SIZE);
  patches.size = 1;
  CHECK(ist_contact_patches(&s->a, &s->b, NULL, &s->workspace, &patches, NULL) == IST_WRONG_SIZE);
  return 0;
}

/* --- Fields ----------------------------------------------------------------------------------- */

/* The half-space z ≤ offset, as a function. */
static void look(const void* context, const double x[3], ist_field_sample_t* sample) {
  sample->distance = *(const double*)context - x[2];
  sample->gradient[2] = -1;
}

static int fields_answer(scene_t* s) {
  static float numbers[125];
  static const double offset = 0.1;
  const ist_pose_t identity = IST_POSE_IDENTITY;
  const ist_tree_t empty = {0};
  ist_field_t field = {.size = sizeof field};
  ist_placed_field_t a = {.size = sizeof a};
  ist_penetration_t answer = {.size = sizeof answer}, again = {.size = sizeof again};
  ist_separation_t gap = {.size = sizeof gap};
  ist_contact_patch_t room[4];
  ist_contact_patches_t patches = {.size = sizeof patches, .patch_size = sizeof room[0]};
  ist_tree_info_t info = {.size = sizeof info};
  double by_plane = 0;
  int kind, i;
  a.field = &field;
  a.pose = identity;
  patches.patches = room;
  patches.capacity = 4;
  for (i = 0; i < 125; ++i) numbers[i] = 0.1f;
  CHECK(ist_tree_get_info(&s->tree_a, &info) == IST_OK);
  for (kind = IST_HALF_SPACE; kind <= IST_MESH; ++kind) {
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
      field.as.heights.heights = numbers;
      field.as.heights.columns = field.as.heights.rows = 5;
      field.as.heights.spacing[0] = field.as.heights.spacing[1] = 0.3;
    } else if (kind == IST_DISTANCE_GRID) {
      field.as.distance_grid.distances = numbers;
      for (i = 0; i < 3; ++i) field.as.distance_grid.points[i] = 5;
      for (i = 0; i < 3; ++i) field.as.distance_grid.origin[i] = -1;
      field.as.distance_grid.spacing = 0.5;
    } else if (kind == IST_FUNCTION) {
      field.as.function.look = look;
      field.as.function.context = &offset;
    } else {
      field.as.mesh.tree = &s->tree_a;
      if (!info.has_field) {
        CHECK(ist_field_penetration(&a, &s->b, NULL, &s->workspace, &answer) == IST_INVALID_INPUT);
        break;
      }
    }
    CHECK(ist_field_penetration(&a, &s->b, NULL, &s->workspace, &answer) == IST_OK);
    CHECK(answer.volume > 0);
    CHECK(ist_field_query(&a, &s->b, NULL, NULL, &s->workspace, &again, &gap) == IST_OK);
    CHECK(memcmp(&answer, &again, sizeof answer) == 0 && gap.distance == 0);
    CHECK(ist_field_contact_patches(&a, &s->b, NULL, &s->workspace, &patches, &again) == IST_OK);
    CHECK(patches.count > 0 && again.volume == answer.volume);
    if (kind == IST_HALF_SPACE || kind == IST_HEIGHTS) {
      if (kind == IST_HALF_SPACE) by_plane = answer.volume;
      CHECK(fabs(answer.volume - by_plane) <= 1e-6 * by_plane);
    }
    s->b.pose.t[2] = 20;
    if (kind != IST_DISTANCE_GRID) {
      CHECK(ist_field_separation(&a, &s->b, NULL, &s->workspace, &gap) == IST_OK);
      CHECK(gap.distance > 10);
    }
    s->b.pose.t[2] = 0;
  }

  /* What they point to, null. */
  memset(&field.as, 0, sizeof field.as);
  for (kind = IST_HEIGHTS; kind <= IST_MESH; ++kind) {
    field.kind = kind;
    CHECK(ist_field_penetration(&a, &s->b, NULL, &s->workspace, &answer) == IST_NULL_POINTER);
    CHECK(is_empty(&answer, sizeof answer, IST_NULL_POINTER));
  }
  field.as.mesh.tree = &empty;
  CHECK(ist_field_penetration(&a, &s->b, NULL, &s->workspace, &answer) == IST_NO_HANDLE);
  memset(&field.as, 0, sizeof field.as);
  for (kind = IST_HALF_SPACE; kind <= IST_CYLINDER; ++kind) { /* no length may be 0 */
    field.kind = kind;
    CHECK(ist_field_penetration(&a, &s->b, NULL, &s->workspace, &answer) == IST_INVALID_INPUT);
  }
  field.kind = 0;
  CHECK(ist_field_penetration(&a, &s->b, NULL, &s->workspace, &answer) == IST_INVALID_INPUT);
  field.kind = 99;
  CHECK(ist_field_penetration(&a, &s->b, NULL, &s->workspace, &answer) == IST_INVALID_INPUT);
  field.size = 8;
  CHECK(ist_field_penetration(&a, &s->b, NULL, &s->workspace, &answer) == IST_WRONG_SIZE);
  a.field = NULL;
  CHECK(ist_field_penetration(&a, &s->b, NULL, &s->workspace, &answer) == IST_NULL_POINTER);
  a.size = 8;
  CHECK(ist_field_penetration(&a, &s->b, NULL, &s->workspace, &answer) == IST_WRONG_SIZE);
  CHECK(ist_field_penetration(NULL, &s->b, NULL, &s->workspace, &answer) == IST_NULL_POINTER);
  CHECK(ist_field_separation(NULL, &s->b, NULL, &s->workspace, &gap) == IST_NULL_POINTER);
  CHECK(ist_field_query(NULL, &s->b, NULL, NULL, &s->workspace, &answer, &gap) == IST_NULL_POINTER);
  CHECK(ist_field_contact_patches(NULL, &s->b, NULL, &s->workspace, &patches, NULL) ==
        IST_NULL_POINTER);
  return 0;
}

/* --- Bodies and motions ----------------------------------------------------------------------- */

static int bodies_are_told(scene_t* s) {
  ist_mass_properties_t mass = {.size = sizeof mass}, placed_mass = {.size = sizeof placed_mass};
  ist_bounds_t bounds = {.size = sizeof bounds}, placed_bounds = {.size = sizeof placed_bounds};
  ist_penetration_t contact = {.size = sizeof contact};
  ist_wrenches_t wrenches = {.size = sizeof wrenches}, of_patches = {.size = sizeof of_patches};
  ist_contact_patch_t room[4];
  ist_contact_patches_t patches = {.size = sizeof patches, .patch_size = sizeof room[0]};
  ist_twist_t towards = {.velocity = {1, 0, 0}};
  ist_placed_tree_t wrong = s->b;
  const ist_tree_t empty = {0};
  const double origin[3] = {0, 0, 0};
  double rate = 1, by_patches = 0, part, sum = 0;
  size_t i;
  int k;

  CHECK(ist_tree_get_mass_properties(&s->tree_b, &mass) == IST_OK && mass.volume > 0);
  CHECK(ist_tree_get_bounds(&s->tree_b, &bounds) == IST_OK);
  CHECK(ist_placed_mass_properties(&s->b, &placed_mass) == IST_OK);
  CHECK(ist_placed_bounds(&s->b, &placed_bounds) == IST_OK);
  CHECK(placed_mass.volume == mass.volume && placed_bounds.radius == bounds.radius);
  CHECK(fabs(placed_mass.centre_of_mass[0] - mass.centre_of_mass[0] - s->b.pose.t[0]) <= 1e-12);
  CHECK(ist_tree_get_mass_properties(NULL, &mass) == IST_NULL_POINTER);
  CHECK(is_empty(&mass, sizeof mass, IST_NULL_POINTER));
  CHECK(ist_tree_get_mass_properties(&empty, &mass) == IST_NO_HANDLE);
  CHECK(ist_tree_get_mass_properties(&s->tree_b, NULL) == IST_NULL_POINTER);
  CHECK(ist_tree_get_bounds(NULL, &bounds) == IST_NULL_POINTER);
  CHECK(ist_tree_get_bounds(&s->tree_b, NULL) == IST_NULL_POINTER);
  CHECK(ist_placed_mass_properties(NULL, &mass) == IST_NULL_POINTER);
  CHECK(ist_placed_mass_properties(&s->b, NULL) == IST_NULL_POINTER);
  CHECK(ist_placed_bounds(NULL, &bounds) == IST_NULL_POINTER);
  CHECK(ist_placed_bounds(&s->b, NULL) == IST_NULL_POINTER);
  wrong.pose.q[0] = 3;
  CHECK(ist_placed_mass_properties(&wrong, &mass) == IST_INVALID_INPUT);
  CHECK(ist_placed_bounds(&wrong, &bounds) == IST_INVALID_INPUT);
  CHECK(is_empty(&bounds, sizeof bounds, IST_INVALID_INPUT));
  mass.size = bounds.size = 0;
  CHECK(ist_tree_get_mass_properties(&s->tree_b, &mass) == IST_WRONG_SIZE);
  CHECK(ist_placed_bounds(&s->b, &bounds) == IST_WRONG_SIZE);

  patches.patches = room;
  patches.capacity = 4;
  CHECK(ist_contact_patches(&s->a, &s->b, NULL, &s->workspace, &patches, &contact) == IST_OK);
  CHECK(ist_wrenches(&contact, &s->b.pose, origin, origin, &wrenches) == IST_OK);
  for (k = 0; k < 3; ++k) {
    CHECK(wrenches.on_b.force[k] == -contact.translation_gradient[k]);
    CHECK(wrenches.on_a.torque[k] == -wrenches.on_b.torque[k]);
    sum += fabs(wrenches.on_b.force[k]);
  }
  CHECK(ist_volume_rate(&contact, &s->b.pose, NULL, &towards, &rate) == IST_OK);
  CHECK(rate == contact.translation_gradient[0]);
  for (i = 0; i < patches.count; ++i) {
    CHECK(ist_patch_volume_rate(&room[i], &s->b.pose, NULL, &towards, &part) == IST_OK);
    by_patches += part;
    CHECK(ist_patch_wrenches(&room[i], &s->b.pose, origin, origin, &of_patches) == IST_OK);
    CHECK(of_patches.on_b.force[0] == room[i].force[0]);
  }
  CHECK(fabs(by_patches - rate) <= 1e-12 * sum);
  CHECK(ist_wrenches(NULL, &s->b.pose, origin, origin, &wrenches) == IST_NULL_POINTER);
  CHECK(wrenches.on_b.force[0] == 0);
  CHECK(ist_wrenches(&contact, NULL, origin, origin, &wrenches) == IST_NULL_POINTER);
  CHECK(ist_wrenches(&contact, &s->b.pose, NULL, origin, &wrenches) == IST_NULL_POINTER);
  CHECK(ist_wrenches(&contact, &s->b.pose, origin, NULL, &wrenches) == IST_NULL_POINTER);
  CHECK(ist_wrenches(&contact, &s->b.pose, origin, origin, NULL) == IST_NULL_POINTER);
  CHECK(ist_patch_wrenches(NULL, &s->b.pose, origin, origin, &wrenches) == IST_NULL_POINTER);
  CHECK(ist_volume_rate(NULL, &s->b.pose, NULL, NULL, &rate) == IST_NULL_POINTER && rate == 0);
  CHECK(ist_volume_rate(&contact, NULL, NULL, NULL, &rate) == IST_NULL_POINTER);
  CHECK(ist_volume_rate(&contact, &s->b.pose, NULL, NULL, NULL) == IST_NULL_POINTER);
  CHECK(ist_patch_volume_rate(NULL, &s->b.pose, NULL, NULL, &rate) == IST_NULL_POINTER);
  wrenches.size = 0;
  CHECK(ist_wrenches(&contact, &s->b.pose, origin, origin, &wrenches) == IST_WRONG_SIZE);
  contact.size = 0;
  CHECK(ist_volume_rate(&contact, &s->b.pose, NULL, NULL, &rate) == IST_WRONG_SIZE);
  return 0;
}

static int impacts_are_found(scene_t* s) {
  const ist_pose_t here = IST_POSE_IDENTITY;
  ist_pose_t there = IST_POSE_IDENTITY, at;
  ist_motion_t motion;
  ist_impact_t impact = {.size = sizeof impact}, other = {.size = sizeof other};
  ist_impact_settings_t settings = {.size = sizeof settings, .duration = 1};
  ist_field_t field = {.size = sizeof field, .kind = IST_HALF_SPACE};
  ist_placed_field_t floor = {.size = sizeof floor, .field = &field, .pose = here};
  ist_placed_tree_t b = s->b;
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
  CHECK(ist_field_time_of_impact(&floor, &b, NULL, &motion, NULL, &s->workspace, &impact) >= 0);
  CHECK(impact.time > 0.3 && impact.time < 0.5);
  settings.max_visits = 1;
  CHECK(ist_time_of_impact(&s->a, &b, NULL, &motion, &settings, &s->workspace, &impact) ==
        IST_BUDGET_EXHAUSTED);

  CHECK(ist_time_of_impact(NULL, &b, NULL, &motion, NULL, &s->workspace, &impact) ==
        IST_NULL_POINTER);
  CHECK(is_empty(&impact, sizeof impact, IST_NULL_POINTER));
  CHECK(ist_time_of_impact(&s->a, NULL, NULL, &motion, NULL, &s->workspace, &impact) ==
        IST_NULL_POINTER);
  CHECK(ist_time_of_impact(&s->a, &b, NULL, &motion, NULL, NULL, &impact) == IST_NULL_POINTER);
  CHECK(ist_time_of_impact(&s->a, &b, NULL, &motion, NULL, &s->workspace, NULL) ==
        IST_NULL_POINTER);
  CHECK(ist_time_of_impact(&s->a, &b, NULL, &motion, NULL, &none, &impact) == IST_NO_HANDLE);
  CHECK(ist_field_time_of_impact(NULL, &b, NULL, &motion, NULL, &s->workspace, &impact) ==
        IST_NULL_POINTER);
  settings.duration = -1;
  CHECK(ist_time_of_impact(&s->a, &b, NULL, &motion, &settings, &s->workspace, &impact) ==
        IST_INVALID_INPUT);
  CHECK(is_empty(&impact, sizeof impact, IST_INVALID_INPUT));
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
  return 0;
}

/* --- Batches ---------------------------------------------------------------------------------- */

static void backwards(void* pool, size_t workers, void (*work)(void* batch, size_t worker),
                      void* batch) {
  *(size_t*)pool += workers;
  while (workers > 0) work(batch, --workers);
}

static void counts_wrongly(void* pool, size_t workers, void (*work)(void* batch, size_t worker),
                           void* batch) {
  (void)pool;
  work(batch, workers + 7);
}

enum { PAIRS = 21 };

static int batches_answer(scene_t* s) {
  ist_placed_tree_t placed[PAIRS];
  ist_pair_t pairs[PAIRS];
  ist_field_pair_t field_pairs[PAIRS];
  ist_penetration_t answers[PAIRS], one = {.size = sizeof one};
  ist_workspace_t workspaces[3] = {0};
  ist_parallel_t parallel = {.size = sizeof parallel, .run = backwards};
  ist_field_t field = {.size = sizeof field, .kind = IST_BALL};
  ist_placed_field_t ball = {.size = sizeof ball};
  const size_t size = sizeof answers[0];
  size_t ran = 0, i;
  parallel.pool = &ran;
  field.as.ball.radius = 0.4;
  ball.field = &field;
  ball.pose = s->a.pose;
  for (i = 0; i < 3; ++i) CHECK(ist_workspace_make(4096, NULL, &workspaces[i]) == IST_OK);
  for (i = 0; i < PAIRS; ++i) {
    placed[i] = s->b;
    placed[i].pose.t[0] = 0.05 * (double)i;
    pairs[i].a = &s->a;
    field_pairs[i].a = &ball;
    pairs[i].b = field_pairs[i].b = i == 7 ? NULL : &placed[i];
  }
  memset(answers, 0xcd, sizeof answers); /* nothing of it is read */
  CHECK(ist_penetration_batch(pairs, PAIRS, NULL, workspaces, 3, answers, size, &parallel) ==
        IST_OK);
  CHECK(ran == 3);
  for (i = 0; i < PAIRS; ++i) {
    ist_penetration(pairs[i].a, pairs[i].b, NULL, &s->workspace, &one);
    CHECK(memcmp(&one, &answers[i], size) == 0);
    CHECK((one.status == IST_NULL_POINTER) == (i == 7));
  }
  CHECK(ist_field_penetration_batch(field_pairs, PAIRS, NULL, workspaces, 3, answers, size, NULL) ==
        IST_OK);
  for (i = 0; i < PAIRS; ++i) {
    ist_field_penetration(field_pairs[i].a, field_pairs[i].b, NULL, &s->workspace, &one);
    CHECK(memcmp(&one, &answers[i], size) == 0);
  }
  parallel.run = counts_wrongly;
  CHECK(ist_penetration_batch(pairs, PAIRS, NULL, workspaces, 3, answers, size, &parallel) ==
        IST_OK);
  CHECK(is_empty(&answers[0], size, IST_NULL_POINTER));
  CHECK(ist_penetration_batch(pairs, PAIRS, NULL, NULL, 0, answers, size, NULL) == IST_OK);
  CHECK(answers[0].status == IST_BUDGET_EXHAUSTED && isinf(answers[0].volume_max));
  CHECK(ist_penetration_batch(NULL, 0, NULL, workspaces, 3, NULL, size, NULL) == IST_OK);

  CHECK(ist_penetration_batch(NULL, PAIRS, NULL, workspaces, 3, answers, size, NULL) ==
        IST_NULL_POINTER);
  CHECK(ist_penetration_batch(pairs, PAIRS, NULL, NULL, 3, answers, size, NULL) ==
        IST_NULL_POINTER);
  CHECK(ist_penetration_batch(pairs, PAIRS, NULL, workspaces, 3, NULL, size, NULL) ==
        IST_NULL_POINTER);
  CHECK(ist_penetration_batch(pairs, PAIRS, NULL, workspaces, 3, answers, size - 8, NULL) ==
        IST_WRONG_SIZE);
  parallel.size = 0;
  CHECK(ist_penetration_batch(pairs, PAIRS, NULL, workspaces, 3, answers, size, &parallel) ==
        IST_WRONG_SIZE);
  CHECK(ist_workspace_release(&workspaces[1]) == IST_OK);
  CHECK(ist_workspace_release(&workspaces[1]) == IST_NO_HANDLE);
  CHECK(ist_penetration_batch(pairs, PAIRS, NULL, workspaces, 3, answers, size, NULL) ==
        IST_NO_HANDLE);
  CHECK(ist_workspace_release(&workspaces[0]) == IST_OK);
  CHECK(ist_workspace_release(&workspaces[2]) == IST_OK);
  return 0;
}

static int released_handles_are_known(scene_t* s) {
  ist_penetration_t answer = {.size = sizeof answer};
  CHECK(ist_tree_release(&s->tree_b) == IST_OK);
  CHECK(ist_penetration(&s->a, &s->b, NULL, &s->workspace, &answer) == IST_NO_HANDLE);
  CHECK(ist_tree_release(&s->tree_b) == IST_NO_HANDLE);
  CHECK(ist_workspace_release(&s->workspace) == IST_OK);
  CHECK(ist_penetration(&s->a, &s->a, NULL, &s->workspace, &answer) == IST_NO_HANDLE);
  CHECK(ist_workspace_release(&s->workspace) == IST_NO_HANDLE);
  CHECK(ist_workspace_release(NULL) == IST_NULL_POINTER);
  CHECK(ist_workspace_make(0, NULL, NULL) == IST_NULL_POINTER);
  CHECK(ist_tree_release(&s->tree_a) == IST_OK);
  return 0;
}

static int versions_and_words(void) {
  int status;
  CHECK(ist_version() == IST_VERSION);
  CHECK(ist_check_version(IST_VERSION) == IST_OK);
  CHECK(ist_check_version(IST_VERSION + 1) == IST_WRONG_VERSION); /* newer than the library */
  CHECK(ist_check_version(IST_VERSION + 100) == IST_WRONG_VERSION);
  CHECK(ist_check_version(IST_VERSION + 10000) == IST_WRONG_VERSION);
  CHECK(ist_check_version(0) == IST_WRONG_VERSION);
  for (status = IST_CORRUPT_LAYOUT - 1; status <= IST_BUDGET_EXHAUSTED + 1; ++status) {
    const int known = status >= IST_CORRUPT_LAYOUT && status <= IST_BUDGET_EXHAUSTED;
    const int unknown = strcmp(ist_describe(status), ist_describe(12345)) == 0;
    CHECK(known != unknown);
  }
  return 0;
}

int c_api_checks(const char* path_a, const char* path_b) {
  scene_t scene;
  if (versions_and_words() != 0 || memory_is_the_callers(path_a) != 0 ||
      trees_are_checked(path_a) != 0 || make_scene(&scene, path_a, path_b) != 0)
    return 1;
  return penetrations_answer(&scene) != 0 || separations_answer(&scene) != 0 ||
         overlaps_answer(&scene) != 0 || patches_answer(&scene) != 0 ||
         fields_answer(&scene) != 0 || bodies_are_told(&scene) != 0 ||
         impacts_are_found(&scene) != 0 || batches_answer(&scene) != 0 ||
         released_handles_are_known(&scene) != 0;
}
