#include "library/manifest.h"

#include <fmt/format.h>
#include <ist/types.h>
#include <toml++/toml.h>
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <utility>

#include "library/glob.h"
#include "library/settings/numbers.h"
#include "library/settings/spelling.h"
#include "mesh/mesh_files.h"

namespace ist {
namespace {

namespace fs = std::filesystem;
using Line = toml::source_index;

/// Keys that are not settings of a bake: requirements for the asset.
constexpr std::string_view kDemands[] = {"require-mesh", "min-coverage", "min-confidence"};

/// Keys that select files and name their assets.
bool is_file_key(std::string_view key) {
  return key == "mesh" || key == "name" || key == "exclude";
}

const Setting* setting_named(std::string_view name) {
  for (const Setting& setting : all_settings())
    if (setting.name == name) return &setting;
  return nullptr;
}

/// "; did you mean 'spheres'?", or all known keys.
std::string other_keys(std::string key, std::vector<std::string> known) {
  std::replace(key.begin(), key.end(), '_', '-');
  for (const Setting& setting : all_settings()) known.push_back(setting.name);
  known.insert(known.end(), std::begin(kDemands), std::end(kDemands));
  if (const std::string nearest = nearest_word(key, known); !nearest.empty())
    return fmt::format("did you mean '{}'?", nearest);
  return fmt::format("known keys are {}", fmt::join(known, ", "));
}

/// A value in the syntax of the command line; nothing for a type that is not allowed.
std::optional<std::string> text_of(const toml::node& value, SettingKind kind) {
  const bool factors = kind == SettingKind::factors;
  const bool number = kind == SettingKind::real || kind == SettingKind::share ||
                      kind == SettingKind::text || factors;
  if (const auto* whole = value.as_integer(); whole && (number || kind == SettingKind::whole))
    return fmt::to_string(whole->get());
  if (const auto* real = value.as_floating_point(); real && number)
    return fmt::to_string(real->get());
  if (const auto* text = value.as_string();
      text && (kind == SettingKind::share || kind == SettingKind::choice ||
               kind == SettingKind::text || factors))
    return text->get();
  if (const auto* list = value.as_array(); list && factors) {
    std::string all;
    for (const toml::node& one : *list) {
      const std::optional<std::string> text = text_of(one, SettingKind::real);
      if (!text) return std::nullopt;
      all += (all.empty() ? "" : ",") + *text;
    }
    return all;
  }
  if (const auto* flag = value.as_boolean(); flag && kind == SettingKind::flag)
    return flag->get() ? "true" : "false";
  return std::nullopt;
}

/// The value as the file spells it, for messages.
std::string shown(const toml::node& value) {
  if (value.is_table()) return "a table";
  if (value.is_array()) return "a list";
  std::ostringstream text;
  value.visit([&](const auto& node) {
    if constexpr (toml::is_value<decltype(node)>) text << node;
  });
  return text.str();
}

/// Settings given in some place, with their lines.
struct Given {
  Demands demands;
  std::map<std::string, Line> lines;
  std::vector<std::pair<const Setting*, std::string>> values;
};

class Reader {
 public:
  explicit Reader(const std::string& path) : path_(path), folder_(fs::path(path).parent_path()) {}

  Manifest read() {
    const std::string text = content();
    toml::table root;
    try {
      root = toml::parse(text, path_);
    } catch (const toml::parse_error& error) {
      fault(error.source().begin.line,
            fmt::format("not valid TOML: {}. See https://toml.io", error.description()));
      return finish();
    }
    bool all_known = true;
    for (const auto& [key, value] : root) {
      static const std::vector<std::string> kTables = {"defaults", "asset", "robot"};
      const std::string name(key.str());
      if (std::count(kTables.begin(), kTables.end(), name) != 0) continue;
      all_known = false;
      const std::string nearest = nearest_word(name, kTables);
      fault(key.source().begin.line,
            nearest.empty()
                ? fmt::format("unknown '{}': a manifest has [defaults] and, for each asset or "
                              "pattern, [[asset]], for each robot [[robot]]",
                              name)
                : fmt::format("unknown '{}': did you mean '{}'?", name, nearest));
    }
    read_defaults(root);
    // If a table's name is unknown, that is the only mistake.
    if (all_known && !root.contains("asset") && !root.contains("robot"))
      fault(1, "no [[asset]]: add at least one");
    read_entries(root, "asset", &Reader::read_asset);
    read_entries(root, "robot", &Reader::read_robot_entry);
    return finish();
  }

 private:
  std::string content() const {
    std::error_code none;
    if (fs::is_directory(path_, none)) throw Error(path_ + ": is a folder, not a manifest");
    std::ifstream file(path_, std::ios::binary);
    if (!file) throw Error(path_ + ": cannot be opened. Check the path and its permissions");
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
  }

  Manifest finish() {
    std::sort(manifest_.jobs.begin(), manifest_.jobs.end(),
              [](const Job& a, const Job& b) { return a.name < b.name; });
    for (auto& [line, what] : faults_)
      manifest_.faults.push_back(fmt::format("{}:{}: {}", path_, line, what));
    return std::move(manifest_);
  }

  void fault(Line line, const std::string& what) { faults_.emplace(line, what); }

  void warn(Line line, const std::string& what) {
    manifest_.warnings.push_back(fmt::format("{}:{}: {}", path_, line, what));
  }

  void read_defaults(const toml::table& root) {
    const toml::node* const node = root.get("defaults");
    if (node == nullptr) return;
    const toml::table* const table = node->as_table();
    if (table == nullptr) return fault(node->source().begin.line, "defaults: write [defaults]");
    for (const auto& [key, value] : *table) {
      if (is_file_key(key.str()))
        fault(key.source().begin.line,
              fmt::format("'{}' cannot be a default: set it under an [[asset]]", key.str()));
      else
        read_setting(key, value, defaults_, {});
    }
  }

  /// Returns false if the key is not a requirement.
  bool read_demand(const toml::key& key, const toml::node& value, Demands& demands) {
    const std::string name(key.str());
    if (std::find(std::begin(kDemands), std::end(kDemands), name) == std::end(kDemands))
      return false;
    const bool is_flag = name == kDemands[0];
    const std::optional<std::string> text =
        text_of(value, is_flag ? SettingKind::flag : SettingKind::share);
    const std::optional<double> share = text && !is_flag ? parse_share(*text) : std::nullopt;
    if (is_flag && text) {
      demands.mesh = *text == "true";
    } else if (share && *share >= 0 && *share <= 1) {
      (name == kDemands[1] ? demands.coverage : demands.confidence) = *share;
    } else {
      fault(key.source().begin.line,
            fmt::format("{}: {} is not {}", name, shown(value),
                        is_flag ? "true or false" : "a share from 0 to 1, as 0.5 or 50%"));
    }
    return true;
  }

  void read_setting(const toml::key& key, const toml::node& value, Given& given,
                    const std::vector<std::string>& besides) {
    const Line line = key.source().begin.line;
    const std::string name(key.str());
    if (read_demand(key, value, given.demands)) return;
    const Setting* const setting = setting_named(name);
    if (setting == nullptr)
      return fault(line, fmt::format("unknown key '{}': {}", name, other_keys(name, besides)));
    const std::optional<std::string> text = text_of(value, setting->kind);
    BakeSettings tried;
    if (!text || !setting->take(tried, *text))
      return fault(line, fmt::format("{}: {} is not {}", name, shown(value), setting->meaning));
    given.lines[name] = line;
    given.values.emplace_back(setting, *text);
  }

  void read_entries(const toml::table& root, const std::string& kind,
                    void (Reader::*read)(const toml::table&)) {
    const toml::node* const node = root.get(kind);
    if (node == nullptr) return;
    const toml::array* const list = node->as_array();
    if (list == nullptr)
      return fault(node->source().begin.line,
                   fmt::format("{0}: write [[{0}]], with two brackets", kind));
    for (const toml::node& entry : *list) {
      if (const toml::table* const table = entry.as_table())
        (this->*read)(*table);
      else
        fault(entry.source().begin.line,
              fmt::format("{0}: write [[{0}]] and its keys under it", kind));
    }
  }

  /// Reads "text" or ["text", …]; records a fault otherwise.
  std::vector<std::string> texts_of(std::string_view key, const toml::node& value) {
    std::vector<std::string> texts;
    const auto take = [&](const toml::node& one) {
      if (const auto* text = one.as_string())
        texts.push_back(text->get());
      else
        fault(one.source().begin.line,
              fmt::format("{}: {} is not a quoted string", key, shown(one)));
    };
    if (const toml::array* const list = value.as_array())
      for (const toml::node& one : *list) take(one);
    else
      take(value);
    return texts;
  }

  void read_robot_entry(const toml::table& table) {
    const Line line = table.source().begin.line;
    const std::size_t faults_before = faults_.size();
    RobotOptions options;
    Given own;
    own.demands = defaults_.demands;
    for (const auto& [key, value] : table) {
      if (key == "urdf") continue;
      if (key == "visual") {
        if (value.is_boolean())
          options.visual = value.as_boolean()->get();
        else
          fault(key.source().begin.line,
                fmt::format("visual: {} is not true or false", shown(value)));
      } else if (key == "skip") {
        options.skipped = texts_of(key.str(), value);
      } else if (key == "packages") {
        if (!value.is_table())
          fault(key.source().begin.line,
                fmt::format("packages: {} is not a table: write packages = {{NAME = \"folder\"}}",
                            shown(value)));
        else
          for (const auto& [name, folder] : *value.as_table())
            for (const std::string& path : texts_of(name.str(), folder))
              options.packages[std::string(name.str())] = (folder_ / path).string();
      } else {
        read_setting(key, value, own, {"urdf", "packages", "visual", "skip"});
      }
    }
    Job like;
    like.demands = own.demands;
    complete_settings(like.settings, own, line);
    for (const Setting& placing : placing_settings())
      for (const Given* given : {&std::as_const(own), &std::as_const(defaults_)})
        if (const auto at = given->lines.find(placing.name); at != given->lines.end())
          fault(at->second,
                placing.name + ": cannot be combined with a robot; its URDF places the meshes");
    const std::optional<std::string> urdf = text_at(table, "urdf");
    if (!urdf) return fault(line, "a robot without a URDF: add urdf = \"path\"");
    if (faults_.size() != faults_before) return;
    try {
      const std::string path = (folder_ / *urdf).lexically_normal().string();
      const RobotModel robot = read_robot_for(options, path);
      const PackagePaths paths = package_paths(path, options);
      if (const auto unseen = links_seen_only(robot, options); !unseen.empty())
        warn(line, fmt::format("{}: left out, because they have visual shapes alone: {}; visual = "
                               "true uses these",
                               path, fmt::join(unseen, ", ")));
      RobotAssets made =
          robot_assets(robot, options.shapes(), file_name_of(robot.name) + "-", like);
      for (Job& job : made.jobs) {
        job.mesh = paths.find(job.mesh);
        std::get<LinkMesh>(job.shape->shape).file = fs::absolute(job.mesh).string();
        add(job, line);
      }
      manifest_.robots.push_back(std::move(made));
    } catch (const Error& error) {
      fault(line, error.what());
    }
  }

  /// Reads a key that must be text; nothing, and perhaps a fault, otherwise.
  std::optional<std::string> text_at(const toml::table& table, const char* key) {
    const toml::node* const node = table.get(key);
    if (node == nullptr) return std::nullopt;
    if (const auto* text = node->as_string(); text != nullptr && !text->get().empty())
      return text->get();
    fault(node->source().begin.line,
          fmt::format("{}: {} is not a quoted string", key, shown(*node)));
    return std::nullopt;
  }

  void read_asset(const toml::table& table) {
    const Line line = table.source().begin.line;
    Given own;
    own.demands = defaults_.demands;
    for (const auto& [key, value] : table)
      if (!is_file_key(key.str())) read_setting(key, value, own, {"mesh", "name", "exclude"});
    Job job;
    job.demands = own.demands;
    complete_settings(job.settings, own, line);
    if (!table.contains("mesh"))
      return fault(line, "an asset without a mesh: add mesh = \"path or pattern\"");
    const std::optional<std::string> mesh = text_at(table, "mesh");
    const std::optional<std::string> name = text_at(table, "name");
    if (!mesh) return;
    const Line mesh_line = table.get("mesh")->source().begin.line;
    const Line name_line = name ? table.get("name")->source().begin.line : mesh_line;
    std::vector<std::string> files = files_for(*mesh, mesh_line);
    if (table.contains("exclude")) exclude(*table.get("exclude"), *mesh, files);
    if (name && name->find('{') == std::string::npos && files.size() > 1)
      return fault(name_line,
                   fmt::format("name: '{}' is one name for the {} files of '{}': include {{stem}}, "
                               "which stands for the file name without its extension",
                               *name, files.size(), *mesh));
    for (const std::string& file : files) {
      try {
        job.name = name_for(name.value_or("{stem}"), file, folder_);
      } catch (const Error& error) {
        return fault(name_line, fmt::format("name: {}", error.what()));
      }
      job.mesh = file;
      add(job, name_line);
    }
  }

  /// Removes the files that patterns match; a pattern that matches none gives a warning.
  void exclude(const toml::node& node, const std::string& mesh, std::vector<std::string>& files) {
    for (const std::string& pattern : texts_of("exclude", node)) {
      const bool absolute = fs::path(pattern).is_absolute();
      const auto gone = std::erase_if(files, [&](const std::string& file) {
        return matches(absolute ? fs::absolute(file)
                                : fs::path(file).lexically_relative(folder_.lexically_normal()),
                       pattern);
      });
      if (gone == 0)
        warn(node.source().begin.line,
             fmt::format("exclude: '{}' excludes none of the files of '{}'", pattern, mesh));
    }
  }

  void complete_settings(BakeSettings& settings, const Given& own, Line line) {
    std::set<std::string> names, own_names;
    for (const Given* given : {&std::as_const(defaults_), &own})
      for (const auto& [setting, text] : given->values) {
        setting->take(settings, text);
        names.insert(setting->name);
      }
    for (const auto& [name, where] : own.lines) own_names.insert(name);
    const std::optional<SettingFault> wrong = complete(settings, names, own_names, "");
    if (!wrong) return;
    const auto in_own = own.lines.find(wrong->name);
    const auto in_defaults = defaults_.lines.find(wrong->name);
    const Line where = in_own != own.lines.end()              ? in_own->second
                       : in_defaults != defaults_.lines.end() ? in_defaults->second
                                                              : line;
    fault(where,
          fmt::format(
              "{}: {}{}", wrong->name, wrong->what,
              in_own == own.lines.end() ? fmt::format(" (in the asset of line {})", line) : ""));
  }

  /// The files that a path or pattern names; none, and a fault, if it is invalid.
  std::vector<std::string> files_for(const std::string& mesh, Line line) {
    std::error_code none;
    const fs::path path = (folder_ / mesh).lexically_normal();
    const std::string folder = folder_.empty() ? "." : folder_.string();
    std::vector<fs::path> found;
    if (fs::exists(path, none)) {
      if (!fs::is_directory(path, none)) {
        found = {path};
      } else {
        fault(line, fmt::format("mesh: '{}' is a folder: use '{}' for the files in it", mesh,
                                (fs::path(mesh) / "*.obj").string()));
        return {};
      }
    } else if (is_pattern(mesh)) {
      found = matching_files(folder_, mesh);
      if (found.empty())
        fault(line,
              fmt::format(
                  "mesh: no file matches '{}' in {}: * matches any name, ** any nested folders",
                  mesh, folder));
    } else {
      fault(line, fmt::format("mesh: no file '{}' in {}: paths are relative to the manifest", mesh,
                              folder));
    }
    std::vector<std::string> files;
    for (const fs::path& file : found) {
      if (is_known(file))
        files.push_back(file.string());
      else
        fault(line, fmt::format("mesh: '{}' does not have the extension of a mesh format{}",
                                file.string(),
                                is_pattern(mesh) ? ": make the pattern narrower, e.g. *.obj" : ""));
    }
    return files;
  }

  bool is_known(const fs::path& file) {
    const std::string ending = file.extension().string();
    const auto known = formats_.find(ending);
    if (known != formats_.end()) return known->second;
    return formats_[ending] = is_mesh_format(file.string());
  }

  void add(const Job& job, Line line) {
    const bool control = std::any_of(job.name.begin(), job.name.end(),
                                     [](char c) { return static_cast<unsigned char>(c) < ' '; });
    constexpr std::size_t kLongest = 200;  // file systems allow 255, including what is appended
    if (job.name.empty() || job.name.starts_with('.') || control || job.name.size() > kLongest ||
        job.name.find('/') != std::string::npos)
      return fault(line, fmt::format("name: '{}' is not a valid file name: use at most {} bytes, "
                                     "no '/', no control characters and no leading dot",
                                     job.name, kLongest));
    const auto [before, is_new] = taken_.try_emplace(job.name, line, job.mesh);
    if (!is_new)
      return fault(
          line, fmt::format(
                    "name: '{}' (of {}) is already used in line {} (of {}): give one of them "
                    "another name = \"…\"; {{stem}} stands for the file name without its extension",
                    job.name, job.mesh, before->second.first, before->second.second));
    manifest_.jobs.push_back(job);
  }

  const std::string path_;
  const fs::path folder_;
  Manifest manifest_;
  std::set<std::pair<Line, std::string>> faults_;
  Given defaults_;
  std::map<std::string, std::pair<Line, std::string>> taken_;  ///< names, line and mesh
  std::map<std::string, bool> formats_;                        ///< by ending
};

}  // namespace

Manifest read_manifest(const std::string& path) { return Reader(path).read(); }

}  // namespace ist
