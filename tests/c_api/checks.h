#ifndef IST_TESTS_C_API_CHECKS_H
#define IST_TESTS_C_API_CHECKS_H

#ifdef __cplusplus
extern "C" {
#endif

/* Every function of ist/ist.h with two assets that overlap at a quarter of their size: 0, or 1 with
 * the first thing that is not as the header says on stderr. */
int c_api_checks(const char* path_a, const char* path_b);

/* The same for ist/c_bake.h and contact laws. */
int c_bake_checks(void);

#ifdef __cplusplus
}
#endif

#endif
