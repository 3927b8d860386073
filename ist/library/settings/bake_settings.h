#pragma once

#include <ist/bake.h>
#include <functional>
#include <optional>
#include <set>
#include <span>
#include <utility>

// All that may be asked of a bake, by name: the options of the command line and the keys of a
// manifest are the same ones, read and checked here.

namespace ist {

/// How the mesh of a file becomes the mesh that is baked.
struct MeshSettings {
  bool repair = false;  ///< close an open mesh
  double wrap = 0;      ///< detail of wrap_mesh() for one that is not closed so; 0: none is wrapped
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();  ///< of the file's axes; scale_mesh() takes it
  char up_axis = 0;     ///< 'X', 'Y' or 'Z': which of the file's axes is up; 0: nothing is turned
  char world_up = 'Z';  ///< the mesh is turned so that this axis is up; where up_axis is given
};

struct BakeSettings {
  MeshSettings mesh;
  PackingSettings packing;  ///< device, GPU and threads are not among what is set by name
  ErrorTarget target = {0, ErrorTarget().at_overlap};  ///< error 0: none is asked for
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
  std::string meaning;   ///< what it takes: "a whole number from 0 to 10"
  std::string fallback;  ///< what it is if not given, for help; "": help says it
  std::string help;
  SettingKind kind;
  /// False: the text is not what `meaning` says. A flag's is "true" or "false".
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

/// To be called once all settings were taken. What was not given and follows from others is set;
/// settings that contradict each other or have no effect are told.
///
/// `given`: names of all that were given. `own`: those given for this bake alone, not as a default
/// of many: to have no effect is then a mistake. Names in a fault's text begin with `prefix`: "--"
/// or "".
std::optional<SettingFault> complete(BakeSettings& settings, const std::set<std::string>& given,
                                     const std::set<std::string>& own, const std::string& prefix);

/// Every setting that the bytes of an asset may depend on, as text; equal text, equal settings.
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
