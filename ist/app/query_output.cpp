#include "app/query_output.h"

#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "library/text.h"

namespace ist::app {
namespace {

/// The numeric columns between `id` and `status`, in order.
std::vector<std::pair<std::string, double>> numbers(const PenetrationAndSeparation& r) {
  const Penetration& p = r.penetration;
  const Separation& s = r.separation;
  std::vector<std::pair<std::string, double>> out = {
      {"volume", p.volume}, {"volume_min", p.volume_min}, {"volume_max", p.volume_max}};
  for (const auto& [name, v] : {std::pair{"c", p.centroid},
                                {"dVdt", p.translation_gradient},
                                {"dVdr", p.rotation_gradient}})
    for (int k = 0; k < 3; ++k) out.emplace_back(std::string(name) + "xyz"[k], v[k]);
  out.insert(out.end(), {{"distance", s.distance},
                         {"distance_min", s.distance_min},
                         {"distance_max", s.distance_max}});
  return out;
}

/// In quotes where it would be more than one field.
std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + '"';
}

}  // namespace

std::uint64_t Answer::node_visits() const {
  return std::uint64_t{result.penetration.node_visits} + result.separation.node_visits;
}

std::uint64_t Answer::sphere_pairs() const {
  return std::uint64_t{result.penetration.sphere_pairs} + result.separation.sphere_pairs;
}

std::string answers_csv(std::span<const Answer> answers) {
  std::string out = "id";
  for (const auto& [name, none] : numbers({})) (out += ',') += name;
  out += ",status,node_visits,sphere_pairs,time_us\n";
  for (const Answer& answer : answers) {
    out += csv_field(answer.row.id);
    for (const auto& [name, value] : numbers(answer.result))
      fmt::format_to(std::back_inserter(out), ",{:.17g}", value);
    fmt::format_to(std::back_inserter(out), ",{},{},{},{:.17g}\n", name_of(answer.status()),
                   answer.node_visits(), answer.sphere_pairs(), answer.time_us);
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
  std::string text;
  const auto line = [&](const char* name, const std::string& value, const char* meaning) {
    text += fmt::format("  {:<10} {:<{}} {}\n", name, value, exact ? 44 : 36, meaning);
  };
  const bool known = !std::isnan(p.volume);
  if (exact) {
    line("volume", known ? fmt::format("{} u³", p.volume) : "unknown",
         p.status == QueryStatus::ok ? "of the true overlap"
         : known ? "of the overlap, by matched spheres: a limit stopped the exact query"
                 : "a limit stopped the exact query, and an asset has no spheres");
    line("bounds", fmt::format("{} … {} u³", p.volume_min, p.volume_max),
         "contain the true volume");
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
                                                   : "accepted, but a limit stopped the query");
  }
  if (known) {
    line("centroid", short_vector(p.centroid) + " u", "of the overlap, in A's frame");
    line("force/k", short_vector(-p.translation_gradient) + " u²", "on B: −dV/d(translation of B)");
    line("torque/k", short_vector(-p.rotation_gradient) + " u³",
         "on B about its origin: −dV/d(rotation of B)");
  }
  if (answer.has_distance()) {
    line("distance", fmt::format("{:.5g} u", s.distance),
         answer.surfaces ? "between the surfaces" : "between the inner spheres");
    line("interval", fmt::format("{:.5g} … {:.5g} u", s.distance_min, s.distance_max),
         "contains the distance of the solids, certified");
  }
  line("query", fmt::format("{:.2f} µs", answer.time_us),
       fmt::format("{}, {} node pairs, {} {} pairs", name_of(answer.status()),
                   grouped(answer.node_visits()), grouped(answer.sphere_pairs()),
                   exact                         ? "triangle"
                   : settings.relative_error > 0 ? "sphere or triangle"
                                                 : "sphere")
           .c_str());
  return text;
}

}  // namespace ist::app
