#include <ist/asset.h>
#include <ist/c.h>

using ist::AssetStatus;

const char* ist_describe(ist_status_t status) {
  switch (status) {
    case IST_OK:
      return "done";
    case IST_BUDGET_EXHAUSTED:
      return "a limit or the workspace's capacity stopped the query before it finished; its bounds "
             "still hold";
    case IST_ERROR_EXCEEDED:
      return "finished, but the error is larger than relative_error: bake both assets with surface "
             "all, or with more spheres";
    case IST_INVALID_INPUT:
      return "a pose, a scale, a number of a shape or a setting is out of range";
    case IST_MISSING_DATA:
      return "an asset lacks data that the query needs: the exact measure needs the kept meshes of "
             "two assets (bake them with surface all), every other query needs spheres (bake "
             "without mesh-only)";
    case IST_NULL_POINTER:
      return "a required pointer is null";
    case IST_WRONG_SIZE:
      return "this library does not know the size of a struct: set it to sizeof, and use headers "
             "and library of one version";
    case IST_WRONG_VERSION:
      return "this library does not support programs compiled with these headers; use headers and "
             "library of one version";
    case IST_NO_HANDLE:
      return "a tree, workspace or scene is empty, released or was never created";
    case IST_NO_MEMORY:
      return "out of memory";
    case IST_CANNOT_READ:
      return "the file cannot be read";
    case IST_TOO_SHORT:
      return describe(AssetStatus::too_short);
    case IST_MISALIGNED:
      return describe(AssetStatus::misaligned);
    case IST_NOT_AN_ASSET:
      return describe(AssetStatus::not_an_asset);
    case IST_OTHER_FORMAT:
      return describe(AssetStatus::other_version);
    case IST_CORRUPT_HASH:
      return describe(AssetStatus::corrupt_hash);
    case IST_CORRUPT_LAYOUT:
      return describe(AssetStatus::corrupt_layout);
    case IST_NO_DURATION:
      return "ist_impact_settings_t::duration is 0; set the duration of the motion";
    case IST_NOT_BAKED:
      return "the mesh or a setting cannot be baked; the message of ist_bake() says why";
    case IST_SCENE_FULL:
      return "the scene is full: make it with a larger max_bodies";
    case IST_NUMBER_TAKEN:
      return "a body of this number is in the scene already";
    case IST_NO_BODY:
      return "no body of the scene has this number";
    default:
      return "unknown status";
  }
}

std::uint32_t ist_version() { return ist::version(); }

ist_status_t ist_check_version(std::uint32_t headers) {
  return ist::serves(headers) ? IST_OK : IST_WRONG_VERSION;
}
