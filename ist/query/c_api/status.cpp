#include <ist/ist.h>
#include <ist/tree_view.h>

using ist::AssetStatus;

const char* ist_describe(ist_status_t status) {
  switch (status) {
    case IST_OK:
      return "done";
    case IST_BUDGET_EXHAUSTED:
      return "a limit or the workspace's capacity stopped the query: what it says of the finished "
             "answer still holds";
    case IST_INVALID_INPUT:
      return "a pose, a scale, a field's number or a setting is out of range";
    case IST_NOT_HELD:
      return "a solid does not hold what is asked: the exact measure wants the mesh of two assets "
             "(bake one with all of its surface), all else wants spheres (bake them)";
    case IST_NULL_POINTER:
      return "a pointer that must not be null is";
    case IST_WRONG_SIZE:
      return "the size of a struct is not known to this library: set it to sizeof, and see whether "
             "headers and library are of one version";
    case IST_WRONG_VERSION:
      return "this library does not serve programs compiled with these headers";
    case IST_NO_HANDLE:
      return "a tree or workspace is empty, released, or was never made";
    case IST_NO_MEMORY:
      return "no memory";
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
      return "ist_impact_settings_t::duration is 0 and asks about no time: set it";
    default:
      return "no status of this library";
  }
}

std::uint32_t ist_version() { return ist::version(); }

ist_status_t ist_check_version(std::uint32_t headers) {
  return ist::serves(headers) ? IST_OK : IST_WRONG_VERSION;
}
