#include "library/settings/bake_settings.h"

#include <fmt/format.h>
#include <algorithm>
#include <cctype>
#include <type_traits>

#include "library/settings/numbers.h"
#include "library/settings/spelling.h"

namespace ist {
namespace {

constexpr std::size_t kMostSpheres = 0x7fffffff;  // the library's limit

// These functions make a setting from the member that it sets: `of(settings)` returns that member.

template <class Of>
using Member = std::remove_reference_t<std::invoke_result_t<Of, BakeSettings&>>;

template <class Of>
Setting whole(const char* name, Of of, Member<Of> least, Member<Of> most, const char* help) {
  BakeSettings defaults;
  return {name,
          "INT",
          fmt::format("a whole number from {} to {}", least, most),
          fmt::to_string(of(defaults)),
          help,
          SettingKind::whole,
          [of, least, most](BakeSettings& settings, const std::string& text) {
            return take_whole(text, least, most, of(settings));
          },
          [of](BakeSettings settings) { return fmt::to_string(of(settings)); }};
}

template <class Of>
Setting number(const char* name, SettingKind kind, Of of, const Range& range, const char* help) {
  BakeSettings defaults;
  const bool is_share = kind == SettingKind::share;
  return {name,
          is_share ? "SHARE" : "NUMBER",
          in_words(range, is_share),
          fmt::format("{:g}", of(defaults)),
          help,
          kind,
          [of, range, is_share](BakeSettings& settings, const std::string& text) {
            return take_number(text, range, is_share, of(settings));
          },
          [of](BakeSettings settings) { return fmt::to_string(of(settings)); }};
}

template <class Of>
Setting real(const char* name, Of of, const Range& range, const char* help) {
  return number(name, SettingKind::real, of, range, help);
}
template <class Of>
Setting share(const char* name, Of of, const Range& range, const char* help) {
  return number(name, SettingKind::share, of, range, help);
}

/// `when`: the member's value if the flag is set.
template <class Of>
Setting flag(const char* name, Of of, bool when, const char* help) {
  return {name,
          "",
          "true or false",
          "",
          help,
          SettingKind::flag,
          [of, when](BakeSettings& settings, const std::string& text) {
            if (text != "true" && text != "false") return false;
            of(settings) = (text == "true") == when;
            return true;
          },
          [of](BakeSettings settings) { return fmt::to_string(of(settings)); }};
}

Setting grid() {
  std::string words;
  for (const auto& [word, mode] : kGridModes)
    words += fmt::format("{}{}", words.empty() ? "" : "|", word);
  return {"grid",
          words,
          "one of " + words,
          "banded",
          "Search grid of the packing",
          SettingKind::choice,
          [](BakeSettings& settings, const std::string& text) {
            for (const auto& [word, mode] : kGridModes)
              if (text == word) {
                settings.packing.grid = mode;
                return true;
              }
            return false;
          },
          [](BakeSettings settings) { return std::string(name_of(settings.packing.grid)); }};
}

Setting keep_mesh() {
  return {"keep-mesh",
          "yes|no",
          "one of yes, no",
          "yes",
          "Keep the mesh in the asset, all of it. Simplify the mesh before the bake for a smaller "
          "one",
          SettingKind::choice,
          [](BakeSettings& settings, const std::string& text) {
            if (text == "yes" || text == "no") settings.packing.keep_mesh = text == "yes";
            return text == "yes" || text == "no";
          },
          [](BakeSettings settings) { return settings.packing.keep_mesh ? "yes" : "no"; }};
}

template <class Of>
Setting axis(const char* name, Of of, const char* fallback, const char* help) {
  return {
      name,
      "X|Y|Z",
      "one of X|Y|Z",
      fallback,
      help,
      SettingKind::choice,
      [of](BakeSettings& settings, const std::string& text) {
        if (text.size() != 1) return false;
        const auto letter = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
        if (letter < 'X' || letter > 'Z') return false;
        of(settings) = letter;
        return true;
      },
      [of](BakeSettings settings) { return std::string(of(settings) == 0 ? 0 : 1, of(settings)); }};
}

Setting factors(const char* name, Eigen::Vector3d MeshSettings::*member, const char* help) {
  return {name,
          "S|SX,SY,SZ",
          "a finite number other than 0, or three",
          "1",
          help,
          SettingKind::factors,
          [member](BakeSettings& settings, const std::string& text) {
            const std::optional<Eigen::Vector3d> parsed = parse_factors(text);
            if (parsed) settings.mesh.*member = *parsed;
            return parsed.has_value();
          },
          [member](BakeSettings settings) {
            const Eigen::Vector3d& s = settings.mesh.*member;
            return fmt::format("{},{},{}", s.x(), s.y(), s.z());
          }};
}

Setting without_default(Setting setting, const char* shown = "") {
  setting.fallback = shown;
  return setting;
}

/// Maps settings to a member of `part`, itself a member of BakeSettings.
template <class Part, class T>
auto member_of(Part BakeSettings::*part, T Part::*member) {
  return [part, member](BakeSettings& settings) -> T& { return (settings.*part).*member; };
}
/// The same, one level deeper.
template <class Part, class T>
auto member_of(Part PackingSettings::*part, T Part::*member) {
  return [part, member](BakeSettings& settings) -> T& { return (settings.packing.*part).*member; };
}

std::vector<Setting> make_settings() {
  const Range from_zero = {};
  return {
      whole("spheres", member_of(&BakeSettings::packing, &PackingSettings::max_spheres), 0,
            kMostSpheres,
            "Largest number of spheres; 0 = no limit. With target-error, 0 is the default and "
            "means 200,000"),
      without_default(share("target-error",
                            member_of(&BakeSettings::target, &ErrorTarget::relative_error),
                            {.least = 0, .most = 1, .without_least = true, .without_most = true},
                            "Insert spheres until the median error of the overlap volume is at "
                            "most this, e.g. 1%; the limit is `spheres`, 200,000 by default")),
      without_default(
          share("at-overlap", member_of(&BakeSettings::target, &ErrorTarget::at_overlap),
                {.least = 1e-4, .most = 0.5},
                "Overlap at which target-error applies, as a share of the solid's volume"),
          "0.1%"),
      share("coverage", member_of(&BakeSettings::packing, &PackingSettings::target_coverage),
            {.least = 0, .most = 1}, "Stop when the spheres fill this share of the solid's volume"),
      real("min-radius", member_of(&BakeSettings::packing, &PackingSettings::min_radius), from_zero,
           "[u] Smallest radius of a sphere"),
      real("time", member_of(&BakeSettings::packing, &PackingSettings::time_limit), from_zero,
           "[s] Time limit of the packing; 0 = no limit. With target-error it limits the whole "
           "search"),
      share("epsilon", member_of(&BakeSettings::packing, &PackingSettings::epsilon),
            {.least = 0, .most = 1, .without_most = true},
            "Greedy tolerance: every radius is at least 1 − epsilon times the largest that fits; 0 "
            "= automatic schedule"),
      keep_mesh(),
      flag(
          "mesh-only", [](BakeSettings& settings) -> bool& { return settings.mesh_only; }, true,
          "Store the mesh without spheres. Such an asset bakes fast and answers exact queries "
          "only"),
      grid(),
      whole("grid-resolution", member_of(&PackingSettings::grids, &GridSettings::resolution), 0,
            kMostGridCells,
            "Cells along the longest side of the fixed grid (uniform, implicit) or of the first "
            "distance grid (hybrid); 0 = automatic"),
      whole("grid-start", member_of(&PackingSettings::grids, &GridSettings::start), 0,
            kMostGridCells,
            "Cells along the longest side of the first grid of prototypes (all but banded); 0 = "
            "automatic"),
      whole("grid-refinements", member_of(&PackingSettings::grids, &GridSettings::refinements), -1,
            kMostGridRefinements,
            "Number of refinements; each splits the cells of that grid into 8 (explicit, implicit, "
            "hybrid); -1 = automatic"),
      whole("grid-rounds", member_of(&PackingSettings::grids, &GridSettings::rounds_per_level), 0,
            std::numeric_limits<unsigned>::max(),
            "Rounds before each refinement (explicit, implicit, hybrid); 0 = automatic"),
      whole("seed", member_of(&BakeSettings::packing, &PackingSettings::seed), 0,
            std::numeric_limits<std::uint64_t>::max(),
            "Random seed that breaks ties; any value packs equally well"),
      flag("repair", member_of(&BakeSettings::mesh, &MeshSettings::repair), true,
           "Close an open mesh and report every change and a confidence in [0, 1]; below 0.6 the "
           "bake fails"),
      without_default(share(
          "wrap", member_of(&BakeSettings::mesh, &MeshSettings::wrap), {.least = 1e-3, .most = 0.1},
          "Enclose a mesh that is not closed, or that repair cannot close, in a closed surface. "
          "The value is the detail as a share of the diagonal, e.g. 0.5%")),
      factors("scale", &MeshSettings::scale,
              "Factor for every coordinate of the mesh, or one for each axis of the file; negative "
              "ones mirror. [u] is the resulting unit"),
      axis("up-axis", member_of(&BakeSettings::mesh, &MeshSettings::up_axis), "",
           "Up axis of the mesh, which is rotated to world-up. Default: no rotation"),
      axis("world-up", member_of(&BakeSettings::mesh, &MeshSettings::world_up), "Z",
           "Up axis of the asset, with up-axis"),
  };
}

const std::vector<Setting>& settings_list() {
  static const std::vector<Setting> list = make_settings();
  return list;
}

/// A setting of the grids that some modes do not use.
struct ModeSetting {
  const char* name;
  bool set;   ///< to a value other than its automatic one
  bool used;  ///< by the mode
  const char* users;
};

/// The fault of a setting that would change nothing but the asset's hash.
std::optional<SettingFault> idle_setting(const PackingSettings& settings,
                                         const std::string& prefix) {
  const GridMode mode = settings.grid;
  const GridSettings& grids = settings.grids;
  const bool refined = mode == GridMode::explicit_refinement ||
                       mode == GridMode::implicit_refinement || mode == GridMode::hybrid;
  const ModeSetting all[] = {
      {"epsilon", settings.epsilon != 0, mode == GridMode::banded, "banded"},
      {"grid-resolution", grids.resolution != 0,
       mode != GridMode::banded && mode != GridMode::explicit_refinement,
       "uniform, implicit and hybrid"},
      {"grid-start", grids.start != 0, mode != GridMode::banded,
       "uniform, explicit, implicit and hybrid"},
      {"grid-refinements", grids.refinements >= 0, refined, "explicit, implicit and hybrid"},
      {"grid-rounds", grids.rounds_per_level != 0, refined, "explicit, implicit and hybrid"},
  };
  for (const ModeSetting& one : all)
    if (one.set && !one.used)
      return SettingFault{one.name, fmt::format("has no effect with {}grid {}, only with {}",
                                                prefix, name_of(mode), one.users)};
  if (mode == GridMode::uniform && grids.resolution != 0 && grids.start != 0)
    return SettingFault{
        "grid-start",
        fmt::format("has no effect with {0}grid uniform where {0}grid-resolution is given",
                    prefix)};
  return std::nullopt;
}

std::optional<SettingFault> mesh_only_fault(const BakeSettings& settings,
                                            const std::set<std::string>& own,
                                            const std::string& prefix) {
  if (!settings.packing.keep_mesh)
    return SettingFault{"mesh-only", "contradicts " + prefix + "keep-mesh no"};
  for (const Setting& setting : settings_list()) {
    if (setting.name == "keep-mesh") break;  // all settings before this one concern packing
    if (own.count(setting.name) != 0)
      return SettingFault{setting.name, "has no effect with " + prefix + "mesh-only"};
  }
  return std::nullopt;
}

std::vector<Setting>::const_iterator setting_named(const char* name) {
  const std::vector<Setting>& list = settings_list();
  return std::find_if(list.begin(), list.end(),
                      [&](const Setting& setting) { return setting.name == name; });
}

}  // namespace

std::span<const Setting> all_settings() { return settings_list(); }

std::span<const Setting> placing_settings() {
  return {setting_named("scale"), settings_list().end()};
}
std::span<const Setting> checking_settings() {
  return {setting_named("wrap"), settings_list().end()};
}
std::span<const Setting> closing_settings() {
  return {setting_named("repair"), setting_named("scale")};
}

std::optional<SettingFault> complete(BakeSettings& settings, const std::set<std::string>& given,
                                     const std::set<std::string>& own, const std::string& prefix) {
  const bool aims = given.count("target-error") != 0;
  // Unless given, the default count is not a limit if an error is the target.
  if (aims && given.count("spheres") == 0) settings.packing.max_spheres = 0;
  if (!aims && own.count("at-overlap") != 0)
    return SettingFault{"at-overlap", "has no effect without " + prefix + "target-error"};
  if (settings.mesh_only)
    if (const auto fault = mesh_only_fault(settings, own, prefix)) return fault;
  if (settings.mesh.up_axis == 0 && own.count("world-up") != 0)
    return SettingFault{"world-up", "has no effect without " + prefix + "up-axis"};
  return idle_setting(settings.packing, prefix);
}

std::string describe_exactly(const BakeSettings& settings) {
  std::string text;
  for (const Setting& setting : settings_list())
    text += setting.name + "=" + setting.show(settings) + "\n";
  return text;
}

const char* name_of(GridMode mode) noexcept {
  for (const auto& [word, known] : kGridModes)
    if (known == mode) return word;
  return "unknown";
}

const char* name_of(MeshState state) noexcept {
  return word_of(state, {"none", "own", "resolved", "polygonised", "unresolved"});
}

}  // namespace ist
