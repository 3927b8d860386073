#include "app/query_rows.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <fstream>
#include <iostream>
#include <istream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>
#include <system_error>

#include "library/csv_reader.h"
#include "library/settings/numbers.h"
#include "library/text.h"

namespace ist::app {
namespace {

constexpr std::array kPose = {"qw", "qx", "qy", "qz", "tx", "ty", "tz"};

double& component(Pose& pose, std::size_t k) { return k < 4 ? pose.q[k] : pose.t[k - 4]; }

/// Normalises a name: "Scale B" and "scale_b" are equal.
std::string plain(const std::string& name) {
  std::string result;
  for (const char c : name)
    if (std::isalnum(static_cast<unsigned char>(c)) != 0)
      result += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return result;
}

/// The index of a column. A duplicate, or one in another spelling, is an error: skipping it would
/// answer another question than asked.
std::optional<std::size_t> find_column(const std::vector<std::string>& header,
                                       const std::string& name, const CsvReader& file) {
  std::optional<std::size_t> found;
  for (std::size_t i = 0; i < header.size(); ++i) {
    if (plain(header[i]) != plain(name)) continue;
    if (header[i] != name)
      file.fail(
          fmt::format("column '{}' must be spelled '{}'; if it means something else, rename it",
                      header[i], name));
    if (found) file.fail(fmt::format("column '{}' appears twice", name));
    found = i;
  }
  return found;
}

struct Columns {
  std::array<std::size_t, kPose.size()> pose;
  std::optional<std::size_t> id, label, scale;

  Columns(const std::vector<std::string>& header, const CsvReader& file)
      : id(find_column(header, "id", file)),
        label(find_column(header, "class", file)),
        scale(find_column(header, "scale_b", file)) {
    for (std::size_t k = 0; k < kPose.size(); ++k) {
      const std::optional<std::size_t> column = find_column(header, kPose[k], file);
      if (!column)
        file.fail(fmt::format("no column '{}'; the header row must contain qw,qx,qy,qz,tx,ty,tz",
                              kPose[k]));
      pose[k] = *column;
    }
  }
};

PoseTable read(std::istream& text, const std::string& name) {
  CsvReader file(text, name);
  std::vector<std::string> header, fields;
  if (!file.next(header)) throw Error(name + ": is empty; the first row must be the header");
  const Columns columns(header, file);
  PoseTable table{{}, columns.label.has_value(), columns.scale.has_value()};
  while (file.next(fields)) {
    if (fields.size() != header.size())
      file.fail(fmt::format("{} fields, but the header has {}", fields.size(), header.size()));
    // nan and inf are valid numbers here: the query judges the pose.
    const auto number = [&](std::size_t column) {
      const std::optional<double> value = parse_number(fields[column]);
      if (!value)
        file.fail(
            fmt::format("'{}' in column '{}' is not a number", fields[column], header[column]));
      return *value;
    };
    PoseRow row;
    row.id = columns.id ? fields[*columns.id] : std::to_string(table.rows.size());
    if (columns.label) row.label = fields[*columns.label];
    for (std::size_t k = 0; k < kPose.size(); ++k) component(row.pose, k) = number(columns.pose[k]);
    if (columns.scale) row.scale_b = number(*columns.scale);
    table.rows.push_back(std::move(row));
  }
  if (text.bad()) throw Error(name + ": reading failed before the end");
  if (table.rows.empty()) throw Error(name + ": no rows after the header");
  return table;
}

/// The numeric columns between `id` and `status`, in order.
std::vector<std::pair<std::string, double>> numbers(const PenetrationAndSeparation& r) {
  const Penetration& p = r.penetration;
  const Separation& s = r.separation;
  std::vector<std::pair<std::string, double>> out = {
      {"volume", p.volume}, {"volume_min", p.volume_min}, {"volume_max", p.volume_max}};
  for (const auto& [name, v] :
       {std::pair{"c", p.centroid}, {"force_", p.force}, {"torque_", p.torque}})
    for (int k = 0; k < 3; ++k) out.emplace_back(std::string(name) + "xyz"[k], v[k]);
  out.insert(out.end(), {{"distance", s.distance},
                         {"distance_min", s.distance_min},
                         {"distance_max", s.distance_max}});
  return out;
}

/// The columns after `time_us`: how the solids touch, which spheres cannot determine.
std::vector<std::pair<std::string, double>> contact_numbers(const Answer& answer) {
  const Penetration& p = answer.result.penetration;
  const auto known = [&](double value) { return answer.exact ? value : std::nan(""); };
  std::vector<std::pair<std::string, double>> out = {{"contact_area", known(p.contact_area)}};
  for (int k = 0; k < 3; ++k)
    out.emplace_back(std::string("contact_n") + "xyz"[k], known(p.contact_normal[k]));
  return out;
}

}  // namespace

Pose parse_pose(const std::string& text) {
  std::istringstream line(text);
  std::vector<std::string> fields;
  CsvReader(line, text).next(fields);
  if (fields.size() != kPose.size())
    throw Error(fmt::format("'{}' is not a pose; write seven numbers qw,qx,qy,qz,tx,ty,tz", text));
  Pose pose;
  for (std::size_t k = 0; k < kPose.size(); ++k) {
    const std::optional<double> value = parse_number(fields[k]);
    if (!value)
      throw Error(
          fmt::format("'{}' is not a pose: {} = '{}' is not a number; write seven numbers "
                      "qw,qx,qy,qz,tx,ty,tz",
                      text, kPose[k], fields[k]));
    component(pose, k) = *value;
  }
  return pose;
}

PoseTable read_pose_table(const std::string& path) {
  if (path == "-") return read(std::cin, "standard input");
  std::ifstream file(path);
  if (!file) throw Error(path + ": cannot open: " + std::generic_category().message(errno));
  return read(file, path);
}

std::string pose_fault(const PoseRow& row) {
  Pose pose = row.pose;
  for (std::size_t k = 0; k < kPose.size(); ++k)
    if (!std::isfinite(component(pose, k)))
      return fmt::format("{} is {}, not a finite number", kPose[k], component(pose, k));
  if (!(row.scale_b > 0) || !std::isfinite(row.scale_b))
    return fmt::format("scale_b is {}, not a finite number above 0", row.scale_b);
  const double* const q = pose.q;
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!(length > 0)) return "the quaternion qw,qx,qy,qz has length 0";
  std::string name = "scale_b";
  double worst = row.scale_b, size = std::max(row.scale_b, 1 / row.scale_b);
  for (std::size_t k = 4; k < kPose.size(); ++k)
    if (const double value = component(pose, k); std::abs(value) > size)
      name = kPose[k], worst = value, size = std::abs(value);
  return fmt::format(
      "{} is {:g}, out of range: sizes and distances may differ by a factor of at most 1e60", name,
      worst);
}

std::uint64_t Answer::node_visits() const {
  return std::uint64_t{result.penetration.node_visits} + result.separation.node_visits;
}

std::uint64_t Answer::sphere_pairs() const {
  return std::uint64_t{result.penetration.sphere_pairs} + result.separation.sphere_pairs;
}

std::string answers_csv(std::span<const Answer> answers) {
  std::string out = "id";
  for (const auto& [name, none] : numbers({})) (out += ',') += name;
  out += ",status,node_visits,sphere_pairs,time_us,touching";
  for (const auto& [name, none] : contact_numbers({})) (out += ',') += name;
  out += '\n';
  for (const Answer& answer : answers) {
    out += csv_field(answer.row.id);
    for (const auto& [name, value] : numbers(answer.result))
      fmt::format_to(std::back_inserter(out), ",{:.17g}", value);
    fmt::format_to(std::back_inserter(out), ",{},{},{},{:.17g},{}", name_of(answer.status()),
                   answer.node_visits(), answer.sphere_pairs(), answer.time_us,
                   !answer.exact                        ? "nan"
                   : answer.result.penetration.touching ? "1"
                                                        : "0");
    for (const auto& [name, value] : contact_numbers(answer))
      fmt::format_to(std::back_inserter(out), ",{:.17g}", value);
    out += '\n';
  }
  return out;
}

std::string answers_json(std::span<const Answer> answers) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const Answer& answer : answers) {
    nlohmann::ordered_json entry = {{"id", answer.row.id}};
    for (const auto& [name, value] : numbers(answer.result)) entry[name] = value;
    entry["status"] = name_of(answer.status());
    entry["node_visits"] = answer.node_visits();
    entry["sphere_pairs"] = answer.sphere_pairs();
    entry["time_us"] = answer.time_us;
    entry["touching"] = nullptr;
    if (answer.exact) entry["touching"] = answer.result.penetration.touching;
    for (const auto& [name, value] : contact_numbers(answer)) entry[name] = value;
    list.push_back(std::move(entry));
  }
  return json_text(list) + "\n";
}

std::string answer_text(const Answer& answer, const PenetrationSettings& settings) {
  const Penetration& p = answer.result.penetration;
  const Separation& s = answer.result.separation;
  if (answer.status() == QueryStatus::invalid_input)
    return fmt::format("  no answer: {}: {}\n", name_of(answer.status()), pose_fault(answer.row));
  const bool exact = settings.measure == Measure::exact;
  const char* const stop = settings.max_visits > 0    ? "--max-visits ended"
                           : settings.pair_budget > 0 ? "--pair-budget ended"
                                                      : "a full workspace ended";
  std::string text;
  const auto line = [&](const char* name, const std::string& value, const std::string& meaning) {
    text += fmt::format("  {:<10} {:<{}} {}\n", name, value, exact ? 44 : 36, meaning);
  };
  const bool known = !std::isnan(p.volume);
  if (exact) {
    line("volume", known ? fmt::format("{} u³", p.volume) : "unknown",
         p.status == QueryStatus::ok ? "of the true overlap"
         : known ? fmt::format("of the overlap, by matched spheres: {} the exact query", stop)
                 : fmt::format("{} the exact query, and an asset has no spheres", stop));
    line("bounds", fmt::format("{} … {} u³", p.volume_min, p.volume_max),
         "contain the true volume");
    if (p.touching && p.contact_area > 0) {
      line("touching", fmt::format("{:.6g} u²", p.contact_area), "faces that lie on each other");
      line("normal", short_vector(p.contact_normal), "their mean, from A to B; zero: they cancel");
    } else if (p.touching) {
      line("touching", "yes", "in points or edges");
    }
  } else {
    line("volume", fmt::format("{:.6g} u³", p.volume),
         settings.measure == Measure::inner ? "of the overlap, by inner spheres: a lower bound"
         : settings.relative_error > 0      ? "of the overlap, by spheres or meshes"
                                            : "of the overlap, by matched spheres");
    line("sum range", fmt::format("{:.6g} … {:.6g} u³", p.volume_min, p.volume_max),
         settings.relative_error > 0
             ? "bounds of the true volume if meshes answered; else the interval of the sum"
             : "interval of the finished sum, not of the true volume");
    if (settings.relative_error > 0)
      line("error", fmt::format("{:g} %", 100 * settings.relative_error),
           p.status == QueryStatus::error_exceeded ? "accepted; predicted error is larger"
           : p.status == QueryStatus::ok           ? "accepted; predicted error is smaller"
                                         : fmt::format("accepted, but {} the query", stop));
  }
  if (known) {
    line("centroid", short_vector(p.centroid) + " u", "of the overlap, in A's frame");
    line("force/k", short_vector(p.force) + " u²", "on B: −dV/d(translation of B)");
    line("torque/k", short_vector(p.torque) + " u³", "on B about its origin: −dV/d(rotation of B)");
  }
  if (answer.has_distance()) {
    const bool farther = std::isinf(s.distance_max);
    line("distance", fmt::format("{}{:.5g} u", farther ? "> " : "", s.distance),
         farther           ? "farther than --max-distance"
         : answer.surfaces ? "between the surfaces"
                           : "between the inner spheres");
    line("interval", fmt::format("{:.5g} … {:.5g} u", s.distance_min, s.distance_max),
         "contains the distance of the solids, certified");
  }
  line("query", fmt::format("{:.2f} µs", answer.time_us),
       fmt::format("{}, {} node pairs, {} {} pairs", name_of(answer.status()),
                   grouped(answer.node_visits()), grouped(answer.sphere_pairs()),
                   exact                         ? "triangle"
                   : settings.relative_error > 0 ? "sphere or triangle"
                                                 : "sphere"));
  return text;
}

}  // namespace ist::app
