#pragma once

#include <ist/bake.h>
#include <functional>
#include <optional>
#include <set>
#include <span>
#include <utility>

// All settings of a bake by name: the options of the command line and the keys of a manifest are
// the same, and are read and checked here.

namespace ist {

/// How the mesh of a file becomes the mesh that is baked.
struct MeshSettings {
  bool repair = false;  ///< close an open mesh
  double wrap = 0;      ///< detail of wrap_mesh() for a mesh that is still open; 0: no wrap
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();  ///< along the file's axes, for scale_mesh()
  char up_axis = 0;     ///< 'X', 'Y' or 'Z': the file's up axis; 0: no rotation
  char world_up = 'Z';  ///< the up axis after rotation, if up_axis is given
};

struct BakeSettings {
  MeshSettings mesh;
  PackingSettings packing;  ///< device, GPU and threads are not set by name
  ErrorTarget target = {0, ErrorTarget().at_overlap};  ///< error 0: none is requested
  bool mesh_only = false;                              ///< bake_mesh_only()
};

enum class SettingKind {
  whole,    ///< 4000
  real,     ///< 0.5
  share,    ///< 0.5 or 50%
  flag,     ///< on the command line --NAME alone; in a file true or false
  factors,  ///< 0.5 for all axes or 1,1,0.5; in a file also [1, 1, 0.5]
  choice,   ///< one of some words
  text,     ///< a word, a number or a share
};

struct Setting {
  std::string name;      ///< "min-radius": --min-radius, or a key of a manifest
  std::string type;      ///< of its value, for help
  std::string meaning;   ///< its valid values: "a whole number from 0 to 10"
  std::string fallback;  ///< the default, for help; "": stated in help
  std::string help;
  SettingKind kind;
  /// Returns false if the text does not match `meaning`. A flag's text is "true" or "false".
  std::function<bool(BakeSettings&, const std::string&)> take;
  std::function<std::string(BakeSettings)> show;  ///< its value, all digits
};

/// In the order in which help shows them.
std::span<const Setting> all_settings();
std::span<const Setting> placing_settings();   ///< scale, up-axis and world-up alone
std::span<const Setting> checking_settings();  ///< wrap and those
std::span<const Setting> closing_settings();   ///< repair and wrap alone

struct SettingFault {
  std::string name;
  std::string what;
};

/// Call after all settings are read. Sets values that follow from others, and reports settings that
/// contradict each other or have no effect.
///
/// `given`: names of all given settings. `own`: those given for this bake alone, not as a default
/// of many: if they have no effect, it is a mistake. Names in a fault's text begin with `prefix`:
/// "--" or "".
std::optional<SettingFault> complete(BakeSettings& settings, const std::set<std::string>& given,
                                     const std::set<std::string>& own, const std::string& prefix);

/// Every setting that may affect the bytes of an asset, as text; equal text means equal settings.
std::string describe_exactly(const BakeSettings& settings);

inline constexpr std::pair<const char*, GridMode> kGridModes[] = {
    {"banded", GridMode::banded},
    {"uniform", GridMode::uniform},
    {"explicit", GridMode::explicit_refinement},
    {"implicit", GridMode::implicit_refinement},
    {"hybrid", GridMode::hybrid}};
const char* name_of(GridMode mode) noexcept;
const char* name_of(MeshState state) noexcept;

}  // namespace ist
