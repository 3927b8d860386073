/* Batches: the bytes that single questions give. */
#include <math.h>

#include "scene.h"

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

enum { CAPACITY = 5 };

/* Lists of CAPACITY patches each; their storage holds a pattern that no answer has. */
static void clear_lists(ist_contact_patches_t* lists, ist_contact_patch_t* storage) {
  size_t i;
  memset(storage, 0xcd, PAIRS * CAPACITY * sizeof *storage);
  for (i = 0; i < PAIRS; ++i) {
    lists[i].size = sizeof lists[i];
    lists[i].patch_size = sizeof *storage;
    lists[i].patches = storage + i * CAPACITY;
    lists[i].capacity = CAPACITY;
    lists[i].count = 77;
  }
}

static int patch_batches_answer(scene_t* s, const ist_pair_t* pairs, const ist_pair_t* field_pairs,
                                ist_workspace_t* workspaces, ist_parallel_t* parallel) {
  static ist_contact_patch_t storage[PAIRS * CAPACITY], lone[CAPACITY];
  static ist_contact_patches_t lists[PAIRS];
  static ist_penetration_t wholes[PAIRS];
  ist_contact_patches_t one_list = {.size = sizeof one_list, .patch_size = sizeof lone[0]};
  ist_penetration_t one = {.size = sizeof one};
  const size_t size = sizeof one;
  size_t i;
  one_list.patches = lone;
  one_list.capacity = CAPACITY;

  clear_lists(lists, storage);
  memset(wholes, 0xcd, sizeof wholes); /* nothing of it is read */
  CHECK(ist_contact_patches_batch(pairs, PAIRS, NULL, workspaces, 3, lists, wholes, size,
                                  parallel) == IST_OK);
  for (i = 0; i < PAIRS; ++i) {
    memset(lone, 0xcd, sizeof lone);
    ist_contact_patches(pairs[i].a, pairs[i].b, NULL, &s->workspace, &one_list, &one);
    CHECK(memcmp(&one, &wholes[i], size) == 0 && one_list.count == lists[i].count);
    CHECK(memcmp(lone, storage + i * CAPACITY, sizeof lone) == 0);
    CHECK((one.status == IST_NULL_POINTER) == (i == 7));
  }
  CHECK(lists[0].count > 0);
  clear_lists(lists, storage);
  lists[3].patch_size = 1;
  CHECK(ist_contact_patches_batch(field_pairs, PAIRS, NULL, workspaces, 3, lists, wholes, size,
                                  NULL) == IST_OK);
  for (i = 0; i < PAIRS; ++i) {
    memset(lone, 0xcd, sizeof lone);
    one_list.patch_size = i == 3 ? 1 : sizeof lone[0];
    ist_contact_patches(field_pairs[i].a, field_pairs[i].b, NULL, &s->workspace, &one_list, &one);
    CHECK(memcmp(&one, &wholes[i], size) == 0 && one_list.count == lists[i].count);
    CHECK(memcmp(lone, storage + i * CAPACITY, sizeof lone) == 0);
    CHECK((one.status == IST_WRONG_SIZE) == (i == 3));
  }
  CHECK(lists[0].count > 0);
  clear_lists(lists, storage);
  CHECK(ist_contact_patches_batch(pairs, PAIRS, NULL, NULL, 0, lists, wholes, size, NULL) ==
        IST_OK);
  CHECK(wholes[0].status == IST_BUDGET_EXHAUSTED && isinf(wholes[0].volume_max));
  CHECK(lists[PAIRS - 1].count == 0);
  CHECK(ist_contact_patches_batch(NULL, 0, NULL, workspaces, 3, NULL, NULL, size, NULL) == IST_OK);

  CHECK(ist_contact_patches_batch(NULL, PAIRS, NULL, workspaces, 3, lists, wholes, size, NULL) ==
        IST_NULL_POINTER);
  CHECK(ist_contact_patches_batch(pairs, PAIRS, NULL, NULL, 3, lists, wholes, size, NULL) ==
        IST_NULL_POINTER);
  CHECK(ist_contact_patches_batch(pairs, PAIRS, NULL, workspaces, 3, NULL, wholes, size, NULL) ==
        IST_NULL_POINTER);
  CHECK(ist_contact_patches_batch(pairs, PAIRS, NULL, workspaces, 3, lists, NULL, size, NULL) ==
        IST_NULL_POINTER);
  CHECK(ist_contact_patches_batch(pairs, PAIRS, NULL, workspaces, 3, lists, wholes, size - 8,
                                  NULL) == IST_WRONG_SIZE);
  lists[2].size = 8;
  CHECK(ist_contact_patches_batch(field_pairs, PAIRS, NULL, workspaces, 3, lists, wholes, size,
                                  NULL) == IST_WRONG_SIZE);
  return 0;
}

/* Distances up to a limit: as single ones, near and far. */
static int gap_batches_answer(scene_t* s, const ist_pair_t* pairs, ist_workspace_t* workspaces) {
  static ist_separation_t gaps[PAIRS];
  ist_separation_t one = {.size = sizeof one};
  ist_separation_settings_t settings = {.size = sizeof settings, .max_distance = 1e-3};
  const size_t size = sizeof one;
  size_t i;
  memset(gaps, 0xcd, sizeof gaps); /* nothing of it is read */
  CHECK(ist_separation_batch(pairs, PAIRS, &settings, workspaces, 3, gaps, size, NULL) == IST_OK);
  for (i = 0; i < PAIRS; ++i) {
    ist_separation(pairs[i].a, pairs[i].b, &settings, &s->workspace, &one);
    CHECK(memcmp(&one, &gaps[i], size) == 0);
    CHECK((one.status == IST_NULL_POINTER) == (i == 7));
  }
  CHECK(gaps[0].distance == 0);
  CHECK(ist_separation_batch(pairs, PAIRS, NULL, NULL, 0, gaps, size, NULL) == IST_OK);
  CHECK(gaps[0].status == IST_BUDGET_EXHAUSTED && isinf(gaps[0].distance_max));
  CHECK(ist_separation_batch(NULL, PAIRS, NULL, workspaces, 3, gaps, size, NULL) ==
        IST_NULL_POINTER);
  CHECK(ist_separation_batch(pairs, PAIRS, NULL, workspaces, 3, gaps, size - 8, NULL) ==
        IST_WRONG_SIZE);
  return 0;
}

int batches_answer(scene_t* s) {
  ist_placed_t placed[PAIRS];
  ist_pair_t pairs[PAIRS];
  ist_pair_t field_pairs[PAIRS];
  ist_penetration_t answers[PAIRS], one = {.size = sizeof one};
  ist_workspace_t workspaces[3] = {0};
  ist_parallel_t parallel = {.size = sizeof parallel, .run = backwards};
  ist_shape_t field = {.size = sizeof field, .kind = IST_BALL};
  ist_placed_t ball = {.size = sizeof ball};
  const size_t size = sizeof answers[0];
  size_t ran = 0, i;
  parallel.pool = &ran;
  field.as.ball.radius = 0.4;
  ball.shape = &field;
  ball.pose = s->a.pose;
  for (i = 0; i < 3; ++i) CHECK(ist_workspace_make(4096, NULL, &workspaces[i]) == IST_OK);
  for (i = 0; i < PAIRS; ++i) {
    placed[i] = s->b;
    placed[i].pose.t[0] = 0.05 * (double)i;
    pairs[i].a = &s->a;
    field_pairs[i].a = &ball;
    pairs[i].b = field_pairs[i].b = i == 7 ? NULL : &placed[i];
  }
  CHECK(gap_batches_answer(s, pairs, workspaces) == 0);
  memset(answers, 0xcd, sizeof answers); /* nothing of it is read */
  CHECK(ist_penetration_batch(pairs, PAIRS, NULL, workspaces, 3, answers, size, &parallel) ==
        IST_OK);
  CHECK(ran == 3);
  for (i = 0; i < PAIRS; ++i) {
    ist_penetration(pairs[i].a, pairs[i].b, NULL, &s->workspace, &one);
    CHECK(memcmp(&one, &answers[i], size) == 0);
    CHECK((one.status == IST_NULL_POINTER) == (i == 7));
  }
  CHECK(ist_penetration_batch(field_pairs, PAIRS, NULL, workspaces, 3, answers, size, NULL) ==
        IST_OK);
  for (i = 0; i < PAIRS; ++i) {
    ist_penetration(field_pairs[i].a, field_pairs[i].b, NULL, &s->workspace, &one);
    CHECK(memcmp(&one, &answers[i], size) == 0);
  }
  parallel.run = counts_wrongly;
  CHECK(ist_penetration_batch(pairs, PAIRS, NULL, workspaces, 3, answers, size, &parallel) ==
        IST_OK);
  CHECK(is_refused(&answers[0], size, IST_NULL_POINTER));
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
  parallel.size = sizeof parallel;
  parallel.run = backwards;
  if (patch_batches_answer(s, pairs, field_pairs, workspaces, &parallel) != 0) return 1;

  CHECK(ist_workspace_release(&workspaces[1]) == IST_OK);
  CHECK(ist_workspace_release(&workspaces[1]) == IST_NO_HANDLE);
  CHECK(ist_penetration_batch(pairs, PAIRS, NULL, workspaces, 3, answers, size, NULL) ==
        IST_NO_HANDLE);
  CHECK(ist_contact_patches_batch(NULL, 0, NULL, workspaces, 3, NULL, NULL, size, NULL) ==
        IST_NO_HANDLE);
  CHECK(ist_workspace_release(&workspaces[0]) == IST_OK);
  CHECK(ist_workspace_release(&workspaces[2]) == IST_OK);
  return 0;
}
