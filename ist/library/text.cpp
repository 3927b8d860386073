#include "library/text.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "library/settings/spelling.h"

namespace ist {

std::string json_text(const nlohmann::ordered_json& json, int indent) {
  return json.dump(indent, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + '"';
}

std::string grouped(std::uint64_t count) {
  std::string digits = std::to_string(count);
  for (std::size_t i = digits.size(); i > 3; i -= 3) digits.insert(i - 3, 1, ',');
  return digits;
}

std::string short_vector(const Eigen::Vector3d& v) {
  // + 0.0 removes the minus sign of a zero.
  return fmt::format("({:.5g}, {:.5g}, {:.5g})", v.x() + 0.0, v.y() + 0.0, v.z() + 0.0);
}

const char* name_of(StopReason reason) noexcept {
  return word_of(
      reason, {"sphere_count", "coverage", "min_radius", "time_limit", "cancelled", "exhausted"});
}

const char* name_of(QueryStatus status) noexcept {
  return word_of(status,
                 {"ok", "budget_exhausted", "invalid_input", "missing_data", "error_exceeded"});
}

const char* name_of(TrialPartner partner) noexcept {
  return word_of(partner, {"copy", "plane", "ball", "edge", "corner", "plate"});
}

}  // namespace ist
