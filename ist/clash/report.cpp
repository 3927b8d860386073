#include "clash/clash.h"

#include <fmt/format.h>
#include <ist/types.h>
#include <algorithm>
#include <cmath>
#include <fstream>

#include "library/text.h"

namespace ist {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kSchema = "ist.clash/1";

Json list(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

}  // namespace

const char* name_of(ClashKind kind) noexcept {
  return kind == ClashKind::overlapping ? "overlapping"
         : kind == ClashKind::touching  ? "touching"
                                        : "apart";
}

ClashReport::Names ClashReport::names_of(const Clash& clash) const {
  return std::minmax(names[clash.a], names[clash.b]);
}

const char* ClashReport::verdict(const Clash& clash) const {
  return clash.volume_min > tolerance    ? "certainly above"
         : clash.volume_max <= tolerance ? "certainly below"
                                         : "undecided";
}

bool ClashReport::is_clash(const Clash& clash) const {
  return clash.kind == ClashKind::overlapping && !(tolerance >= 0 && clash.volume_max <= tolerance);
}

std::size_t ClashReport::new_clashes() const {
  return static_cast<std::size_t>(std::count_if(pairs.begin(), pairs.end(), [&](const Clash& c) {
    return is_clash(c) && earlier.count(names_of(c)) == 0;
  }));
}

std::vector<ClashReport::Names> ClashReport::resolved() const {
  std::set<Names> left = earlier;
  for (const Clash& clash : pairs)
    if (is_clash(clash)) left.erase(names_of(clash));
  for (const auto& fault : faults)  // its pairs are unknown
    std::erase_if(left, [&](const Names& pair) {
      return pair.first == fault.first || pair.second == fault.first;
    });
  return {left.begin(), left.end()};
}

Json clashes_json(const ClashReport& report) {
  Json pairs = Json::array();
  for (const Clash& c : report.pairs) {
    Json pair = {{"a", report.names[c.a]},         {"b", report.names[c.b]},
                 {"kind", name_of(c.kind)},        {"volume", c.volume},
                 {"volume_min", c.volume_min},     {"volume_max", c.volume_max},
                 {"contact_area", c.contact_area}, {"centroid", list(c.centroid)},
                 {"direction", list(c.direction)}, {"depth", c.depth},
                 {"distance_min", c.distance_min}, {"distance_max", c.distance_max},
                 {"status", name_of(c.status)},    {"duplicate", c.duplicate}};
    if (report.tolerance >= 0) pair["verdict"] = report.verdict(c);
    if (report.swept) pair["pose"] = c.pose;
    if (report.compared) {
      const bool known = report.earlier.count(report.names_of(c)) != 0;
      pair["change"] = !report.is_clash(c) ? Json() : Json(known ? "persistent" : "added");
    }
    pairs.push_back(std::move(pair));
  }
  Json faults = Json::array();
  for (const auto& [part, what] : report.faults) faults.push_back({{"part", part}, {"what", what}});
  Json out = {{"schema", kSchema}, {"parts", report.parts}, {"pairs", pairs}};
  if (report.compared) {
    Json& resolved = out["resolved"] = Json::array();
    for (const auto& [a, b] : report.resolved()) resolved.push_back({{"a", a}, {"b", b}});
  }
  out["faults"] = faults;
  out["notes"] = report.notes;
  return out;
}

std::string clashes_csv(const ClashReport& report) {
  const Json all = clashes_json(report);
  std::string out =
      "a,b,kind,volume,volume_min,volume_max,contact_area,centroid_x,centroid_y,centroid_z,"
      "direction_x,direction_y,direction_z,depth,distance_min,distance_max,status,duplicate";
  for (const char* const column : {"verdict", "pose", "change"})
    if (!all["pairs"].empty() && all["pairs"][0].contains(column))
      out += fmt::format(",{}", column);
  out += "\n";
  const auto field = [](const Json& value) {
    return value.is_string()   ? csv_field(value.get<std::string>())
           : value.is_null()   ? std::string()
           : value.is_number() ? fmt::format("{:.17g}", value.get<double>())
                               : value.dump();
  };
  for (const Json& pair : all["pairs"]) {
    std::vector<std::string> fields;
    for (const Json& value : pair)
      for (const Json& one : value.is_array() ? value : Json::array({value}))
        fields.push_back(field(one));
    out += fmt::format("{}\n", fmt::join(fields, ","));
  }
  return out;
}

std::string place_text(const Eigen::Vector3d& x) {
  const double largest = std::max(1.0, x.cwiseAbs().maxCoeff());
  const int digits = std::max(5, 2 + static_cast<int>(std::log10(largest)));
  return fmt::format("({:.{}g}, {:.{}g}, {:.{}g})", x.x(), digits, x.y(), digits, x.z(), digits);
}

std::string clashes_text(const ClashReport& report) {
  std::size_t counts[3] = {}, width = 4;
  for (const Clash& c : report.pairs) {
    ++counts[static_cast<int>(c.kind)];
    width = std::max({width, report.names[c.a].size(), report.names[c.b].size()});
  }
  std::string out = fmt::format("{} parts: {} overlapping, {} touching, {} apart\n", report.parts,
                                counts[0], counts[1], counts[2]);
  width = std::min<std::size_t>(width, 32);
  for (const Clash& c : report.pairs) {
    out += fmt::format("{:<11}  {:<{}}  {:<{}}  ", name_of(c.kind), report.names[c.a], width,
                       report.names[c.b], width);
    if (c.status != QueryStatus::ok)
      out +=
          fmt::format("{}: volume {:.6g} to {:.6g}", name_of(c.status), c.volume_min, c.volume_max);
    else if (c.kind == ClashKind::overlapping)
      out += fmt::format("volume {:.6g}, depth {:.4g}", c.volume, c.depth);
    else if (c.kind == ClashKind::touching)
      out += fmt::format("area {:.6g}", c.contact_area);
    else
      out += fmt::format("distance {:.6g}", c.distance_max);
    out += " at " + place_text(c.centroid);
    if (c.duplicate) out += ", one part twice in one place";
    if (report.swept) out += ", pose " + c.pose;
    if (report.tolerance >= 0 && c.kind == ClashKind::overlapping)
      out += fmt::format(", tolerance: {}", report.verdict(c));
    if (report.compared && report.is_clash(c))
      out += report.earlier.count(report.names_of(c)) != 0 ? ", persistent" : ", added";
    out += "\n";
  }
  for (const auto& [a, b] : report.resolved()) out += fmt::format("resolved     {}  {}\n", a, b);
  for (const auto& [part, what] : report.faults)
    out += fmt::format("not answered: {}: {}\n", part, what);
  for (const std::string& note : report.notes) out += fmt::format("note: {}\n", note);
  return out;
}

std::set<ClashReport::Names> read_clashes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw Error(path + ": cannot be opened. Check the path and its permissions");
  std::set<ClashReport::Names> out;
  try {
    const Json all = Json::parse(file);
    if (all.at("schema") != kSchema) throw Error(path + ": its schema is not " + kSchema);
    for (const Json& pair : all.at("pairs"))
      if (pair.at("kind") == name_of(ClashKind::overlapping) &&
          pair.value("verdict", "") != "certainly below")
        out.insert(std::minmax(pair.at("a").get<std::string>(), pair.at("b").get<std::string>()));
  } catch (const Json::exception& error) {
    throw Error(fmt::format("{}: is no report of ist clash --json: {}", path, error.what()));
  }
  return out;
}

}  // namespace ist
