#ifndef IST_TESTS_C_API_SCENE_H
#define IST_TESTS_C_API_SCENE_H

#include <ist/c.h>
#include <stdio.h>
#include <string.h>

#define CHECK(condition)                                              \
  do {                                                                \
    if (!(condition)) {                                               \
      fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition); \
      return 1;                                                       \
    }                                                                 \
  } while (0)

/* All zero but the size and the status. */
static inline int is_empty(const void* answer, size_t size, ist_status_t status) {
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

/* Whether the numbers of a query's answer are NaN and its counts 0. */
static inline int is_refused(const void* answer, size_t size, ist_status_t status) {
  size_t i, unknown = 0;
  ist_status_t found;
  memcpy(&found, (const char*)answer + 4, sizeof found);
  if (found != status) return 0;
  for (i = 8; i < size; i += 8) {
    double number;
    memcpy(&number, (const char*)answer + i, sizeof number);
    if (number != number)
      ++unknown;
    else if (memcmp(&number, &(double){0}, sizeof number) != 0)
      return 0;
  }
  return unknown >= 3;
}

/* Two trees that overlap. */
typedef struct scene {
  ist_asset_t tree_a, tree_b;
  ist_placed_t a, b;
  ist_workspace_t workspace;
} scene_t;

/* Each: 0, or 1 with the first thing that is not as the header says on stderr. */
int penetrations_answer(scene_t* s);
int deadlines_limit(scene_t* s);
int separations_answer(scene_t* s);
int overlaps_answer(scene_t* s);
int patches_answer(scene_t* s);
int outlines_answer(scene_t* s);
int fields_answer(scene_t* s);
int bodies_are_told(scene_t* s);
int impacts_are_found(scene_t* s);
int batches_answer(scene_t* s);
int balls_are_told(scene_t* s);
int surfaces_are_told(scene_t* s);
int lenses_are_told(scene_t* s);
int scenes_answer(scene_t* s);

#endif
