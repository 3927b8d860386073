#include "clash/assembly.h"

#include <fmt/format.h>
#include <ist/bake.h>
#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>

#include "base/thread_arena.h"
#include "library/csv_reader.h"
#include "library/input_mesh.h"
#include "library/settings/numbers.h"
#include "mesh/import/source_file.h"

namespace ist {
namespace {

using Pattern = ClashSource::Patterns;

/// `*` stands for any letters and `?` for one, in UTF-8; brackets and all else for themselves.
bool stands_for(const std::string& pattern, const std::string& name) {
  std::size_t p = 0, n = 0, star = std::string::npos, from = 0;
  const auto next_letter = [&](std::size_t at) {
    do ++at;
    while (at < name.size() && (name[at] & 0xc0) == 0x80);
    return at;
  };
  while (n < name.size()) {
    if (p < pattern.size() && pattern[p] == '*') {
      star = p++;
      from = n;
    } else if (p < pattern.size() && (pattern[p] == '?' || pattern[p] == name[n])) {
      n = pattern[p++] == '?' ? next_letter(n) : n + 1;
    } else if (star != std::string::npos) {
      p = star + 1;
      n = from = next_letter(from);
    } else {
      return false;
    }
  }
  return pattern.find_first_not_of('*', p) == std::string::npos;
}

bool names(const Pattern& patterns, const std::string& name) {
  return std::any_of(patterns.begin(), patterns.end(), [&](const std::string& pattern) {
    return pattern == name || stands_for(pattern, name);
  });
}

/// Replaces groups' names by their parts.
std::vector<Assembly::Rule> rules_of(ClashSource& source) {
  const auto set = [&](const Pattern& patterns) {
    std::vector<bool> found;
    for (const ClashSource::Part& part : source.parts)
      found.push_back(names(patterns, part.name) ||
                      std::any_of(source.groups.begin(), source.groups.end(), [&](const auto& one) {
                        return names(patterns, one.first) && names(one.second, part.name);
                      }));
    if (std::count(found.begin(), found.end(), true) == 0)
      source.notes.push_back(
          fmt::format("a rule for '{}' names no part", fmt::join(patterns, ", ")));
    return found;
  };
  std::vector<Assembly::Rule> rules;
  for (const auto& [a, b] : source.ignored) rules.push_back({set(a), set(b)});
  for (const auto& [name, patterns] : source.groups) {
    const std::vector<bool> members = set(patterns);
    rules.push_back({members, members});
  }
  return rules;
}

/// Reads the rows of a sweep: a robot's joints by column; or a part's pose per line, consecutive
/// lines of one id together.
std::vector<Assembly::Row> read_poses(const std::string& path, const ClashSource& source,
                                      const std::vector<Pose>& still) {
  std::istringstream text(read_source_file(path).bytes);
  CsvReader file(text, path);
  std::vector<std::string> header, fields;
  std::vector<Assembly::Row> rows;
  std::set<std::string> ids, placed;  // names of all rows; parts of the last row
  static const std::vector<std::string> kPose = {"qw", "qx", "qy", "qz", "tx", "ty", "tz"};
  while (file.next(fields)) {
    if (std::all_of(fields.begin(), fields.end(), [](const auto& one) { return one.empty(); }))
      continue;
    if (header.empty()) {
      header = fields;
      if (std::set<std::string>(header.begin(), header.end()).size() != header.size())
        file.fail("two columns have one name");
      for (const std::string& column : header)
        if (!source.posed && column != "id" && column != "part" &&
            std::count(kPose.begin(), kPose.end(), column) == 0)
          file.fail(fmt::format("unknown column '{}': write id,part,qw,qx,qy,qz,tx,ty,tz", column));
      if (!source.posed && header.size() != 9)
        file.fail("write the columns id,part,qw,qx,qy,qz,tx,ty,tz");
      continue;
    }
    if (fields.size() != header.size())
      file.fail(fmt::format("{} fields, the first line has {}", fields.size(), header.size()));
    std::string id = std::to_string(rows.size()), part;
    std::map<std::string, double> values;
    for (std::size_t k = 0; k < fields.size(); ++k) {
      const std::string& column = header[k];
      if (column == "id" || (!source.posed && column == "part")) {
        (column == "id" ? id : part) = fields[k];
        continue;
      }
      const std::optional<double> value = parse_number(fields[k]);
      if (!value || !std::isfinite(*value))
        file.fail(fmt::format("{}: '{}' is not a finite number", column, fields[k]));
      values[column] = *value;
    }
    if (source.posed) {
      try {
        rows.push_back({id, source.posed(values)});
      } catch (const Error& error) {
        file.fail(error.what());
      }
      continue;
    }
    const auto named = std::find_if(source.parts.begin(), source.parts.end(),
                                    [&](const auto& one) { return one.name == part; });
    if (named == source.parts.end()) file.fail(fmt::format("no part is called '{}'", part));
    if (rows.empty() || rows.back().name != id) {
      if (!ids.insert(id).second)
        file.fail(
            fmt::format("the id '{}' was given before: put the lines of one id together", id));
      rows.push_back({id, still});
      placed.clear();
    }
    if (!placed.insert(part).second)
      file.fail(fmt::format("'{}' is placed twice by the id '{}'", part, id));
    Pose& pose = rows.back().poses[static_cast<std::size_t>(named - source.parts.begin())];
    for (std::size_t k = 0; k < 7; ++k) (k < 4 ? pose.q[k] : pose.t[k - 4]) = values[kPose[k]];
    if (const double size = Eigen::Vector4d(pose.q).norm(); !(size >= 1e-100 && size <= 1e100))
      file.fail("qw, qx, qy, qz are no quaternion: not all of them may be 0");
  }
  if (rows.empty()) throw Error(path + ": holds no poses");
  return rows;
}

std::vector<Assembly::Row> joint_rows(const std::vector<JointRange>& ranges,
                                      const ClashSource& source) {
  constexpr std::size_t kMost = 100'000;
  std::size_t count = 1;
  for (const JointRange& range : ranges)
    if ((count *= range.count) > kMost)
      throw Error(fmt::format("--pose: more than {} poses; take fewer of each joint", kMost));
  std::vector<Assembly::Row> rows;
  for (std::size_t i = 0; i < count; ++i) {
    std::map<std::string, double> values;
    std::string name;
    std::size_t rest = i;
    for (const JointRange& range : ranges) {
      const std::size_t k = rest % range.count;
      rest /= range.count;
      const double value = range.count == 1
                               ? range.first
                               : range.first + (range.last - range.first) * static_cast<double>(k) /
                                                   static_cast<double>(range.count - 1);
      values[range.joint] = value;
      if (range.count > 1)
        name += fmt::format("{}{}={:g}", name.empty() ? "" : " ", range.joint, value);
    }
    rows.push_back({name, source.posed(values)});
  }
  return rows;
}

/// A shape's asset, or the reason why there is none, and notes for its parts.
struct Made {
  std::shared_ptr<const Asset> asset;
  std::string fault;
  std::vector<std::string> notes;
};

Made make(const ClashShape& shape, const MeshSettings& closing) {
  Made out;
  try {
    if (!shape.mesh) {
      out.asset = std::make_shared<const Asset>(Asset::load(shape.name));
      if (!out.asset->view().has_mesh())
        out.fault = shape.name + ": keeps no mesh; bake it again with --keep-mesh yes";
      return out;
    }
    const ClosedMesh closed = close_as_asked(shape.mesh(), shape.name, closing);
    out.notes = closed.report.notes;
    // A single thread: many shapes are made at once.
    out.asset = std::make_shared<const Asset>(bake_mesh_only(closed, 1));
  } catch (const Error& error) {
    out.fault = error.what();
  }
  return out;
}

}  // namespace

Assembly read_assembly(const std::string& path, const AssemblyOptions& options) {
  ClashSource source;
  const std::string ending = ending_of(path);
  const bool robot = ending == ".urdf" || ending == ".xml" || ending == ".mjcf" || ending == ".sdf";
  if (ending == ".toml")
    read_clash_toml(path, false, source);
  else if (ending == ".glb" || ending == ".gltf")
    read_clash_scene(path, source);
  else if (robot)
    read_clash_robot(path, options.robot, source);
  else
    throw Error(path +
                ": is no assembly: name a .toml of parts, a scene (.glb, .gltf) or a robot "
                "(.urdf, .xml, .sdf)");
  if (!options.rules.empty()) read_clash_toml(options.rules, true, source);
  const std::vector<Assembly::Rule> rules = rules_of(source);

  std::vector<Pose> still;
  for (const ClashSource::Part& part : source.parts) still.push_back(part.pose);
  std::vector<Assembly::Row> rows = {{"", still}};
  if (!options.poses.empty())
    rows = read_poses(options.poses, source, still);
  else if (robot)
    rows = joint_rows(options.joints, source);

  // Reads only parts that some pair needs.
  const std::size_t n = source.parts.size();
  std::vector<bool> asked(source.shapes.size(), false), part_asked(n, true);
  for (std::size_t i = 0; i < n; ++i) {
    for (const auto& [a, b] : rules)
      for (const auto& [one, other] : {std::pair(&a, &b), std::pair(&b, &a)})
        if ((*one)[i] && std::count(other->begin(), other->end(), false) == 0)
          part_asked[i] = false;
    if (part_asked[i]) asked[source.parts[i].shape] = true;
  }
  std::vector<Made> made(source.shapes.size());
  thread_arena(options.threads).execute([&] {
    for_each_index(0, made.size(), 1, [&](std::size_t i) {
      if (asked[i]) made[i] = make(source.shapes[i], options.closing);
    });
  });

  Assembly out;
  out.notes = std::move(source.notes);
  out.count = n;
  out.rows.resize(rows.size());
  for (std::size_t r = 0; r < rows.size(); ++r) out.rows[r].name = rows[r].name;
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < n; ++i) {
    const ClashSource::Part& part = source.parts[i];
    const Made& shape = made[part.shape];
    if (!part_asked[i]) {
      out.notes.push_back(part.name + ": all its pairs are ignored");
      continue;
    }
    if (!shape.fault.empty()) {
      out.faults.push_back({part.name, shape.fault});
      continue;
    }
    const ClashShape& from = source.shapes[part.shape];
    out.assets.push_back(shape.asset);
    out.parts.push_back({part.name, PlacedAsset{shape.asset->view(), rows[0].poses[i], part.scale},
                         from.rounding, part.scale * from.slack, from.placing});
    for (std::size_t r = 0; r < rows.size(); ++r) out.rows[r].poses.push_back(rows[r].poses[i]);
    kept.push_back(i);
  }
  for (std::size_t s = 0; s < made.size(); ++s) {
    std::vector<std::string> of;
    for (const std::size_t i : kept)
      if (source.parts[i].shape == s) of.push_back(source.parts[i].name);
    for (const std::string& note : made[s].notes)
      if (!of.empty())
        out.notes.push_back(
            fmt::format("{}{}: {}", of.front(),
                        of.size() > 1 ? fmt::format(" and {} more", of.size() - 1) : "", note));
  }
  for (const auto& [a, b] : rules) {
    Assembly::Rule& rule = out.rules.emplace_back();
    for (const std::size_t i : kept) {
      rule.a.push_back(a[i]);
      rule.b.push_back(b[i]);
    }
  }
  return out;
}

std::vector<Clash> find_clashes(const Assembly& assembly, const ClashSettings& settings) {
  std::map<std::pair<std::size_t, std::size_t>, Clash> worst;
  std::vector<ClashPart> parts = assembly.parts;
  const std::vector<Pose>& first = assembly.rows.front().poses;
  const auto same = [](const Pose& x, const Pose& y) {
    return std::equal(x.q, x.q + 4, y.q) && std::equal(x.t, x.t + 3, y.t);
  };
  for (const Assembly::Row& row : assembly.rows) {
    std::vector<bool> as_first(parts.size());
    for (std::size_t i = 0; i < parts.size(); ++i) {
      parts[i].solid.pose = row.poses[i];
      as_first[i] = &row != &assembly.rows.front() && same(row.poses[i], first[i]);
    }
    for (Clash& found : find_clashes(parts, settings, [&](std::size_t a, std::size_t b) {
           return (as_first[a] && as_first[b]) ||
                  std::any_of(assembly.rules.begin(), assembly.rules.end(), [&](const auto& rule) {
                    return (rule.a[a] && rule.b[b]) || (rule.a[b] && rule.b[a]);
                  });
         })) {
      found.pose = row.name;
      const auto [known, fresh] = worst.try_emplace({found.a, found.b}, found);
      if (!fresh && is_worse(found, known->second)) known->second = std::move(found);
    }
  }
  std::vector<Clash> out;
  for (auto& [pair, clash] : worst) out.push_back(std::move(clash));
  return out;
}

}  // namespace ist
