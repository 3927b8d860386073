#include "c_api/structs.h"

namespace {

struct Sentence {
  ist_status_t status;
  const char* text;
};

constexpr Sentence kSentences[] = {
    {IST_OK, "done"},
    {IST_BUDGET_EXHAUSTED,
     "a limit or the workspace's capacity stopped the query before it finished; its bounds still "
     "hold"},
    {IST_ERROR_EXCEEDED,
     "finished, but the error is larger than relative_error: bake both assets with their meshes, "
     "or with more spheres"},
    {IST_INVALID_INPUT, "a pose, a scale, a number of a shape or a setting is out of range"},
    {IST_MISSING_DATA,
     "an asset lacks data that the query needs: the exact measure needs the kept meshes of two "
     "assets, every other query needs spheres (bake without mesh-only)"},
    {IST_NULL_POINTER, "a required pointer is null"},
    {IST_WRONG_SIZE,
     "this library does not know the size of a struct: set it to sizeof, and use headers and "
     "library of one version"},
    {IST_WRONG_VERSION,
     "this library does not support programs compiled with these headers; use headers and library "
     "of one version"},
    {IST_NO_HANDLE, "a tree, workspace or scene is empty, released or was never created"},
    {IST_NO_MEMORY, "out of memory"},
    {IST_CANNOT_READ, "the file cannot be read"},
    {IST_NO_DURATION, "ist_impact_settings_t::duration is 0; set the duration of the motion"},
    {IST_NOT_BAKED, "the mesh or a setting cannot be baked; the message of ist_bake() says why"},
    {IST_SCENE_FULL, "the scene is full: make it with a larger max_bodies"},
    {IST_NUMBER_TAKEN, "a body of this number is in the scene already"},
    {IST_NO_BODY, "no body of the scene has this number"},
};

}  // namespace

const char* ist_describe(ist_status_t status) {
  for (const Sentence& one : kSentences)
    if (one.status == status) return one.text;
  if (status <= IST_TOO_SHORT && status >= IST_CORRUPT_LAYOUT)
    return describe(ist::c_api::asset_status_of(status));
  return "unknown status";
}

std::uint32_t ist_version() { return ist::version(); }

ist_status_t ist_check_version(std::uint32_t headers) {
  return ist::serves(headers) ? IST_OK : IST_WRONG_VERSION;
}
