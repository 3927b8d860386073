#include "library/text.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace ist {

std::string json_text(const nlohmann::ordered_json& json, int indent) {
  return json.dump(indent, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

std::string grouped(std::uint64_t count) {
  std::string digits = std::to_string(count);
  for (std::size_t i = digits.size(); i > 3; i -= 3) digits.insert(i - 3, 1, ',');
  return digits;
}

std::string short_vector(const Eigen::Vector3d& v) {
  // + 0.0: no minus sign before a zero.
  return fmt::format("({:.5g}, {:.5g}, {:.5g})", v.x() + 0.0, v.y() + 0.0, v.z() + 0.0);
}

const char* name_of(StopReason reason) noexcept {
  switch (reason) {
    case StopReason::sphere_count:
      return "sphere_count";
    case StopReason::coverage:
      return "coverage";
    case StopReason::min_radius:
      return "min_radius";
    case StopReason::time_limit:
      return "time_limit";
    case StopReason::cancelled:
      return "cancelled";
    case StopReason::exhausted:
      return "exhausted";
  }
  return "unknown";
}

const char* name_of(QueryStatus status) noexcept {
  switch (status) {
    case QueryStatus::ok:
      return "ok";
    case QueryStatus::budget_exhausted:
      return "budget_exhausted";
    case QueryStatus::invalid_input:
      return "invalid_input";
    case QueryStatus::missing_data:
      return "missing_data";
    case QueryStatus::error_exceeded:
      return "error_exceeded";
  }
  return "unknown";
}

const char* name_of(TrialPartner partner) noexcept {
  switch (partner) {
    case TrialPartner::copy:
      return "copy";
    case TrialPartner::plane:
      return "plane";
    case TrialPartner::ball:
      return "ball";
    case TrialPartner::edge:
      return "edge";
    case TrialPartner::corner:
      return "corner";
    case TrialPartner::plate:
      return "plate";
  }
  return "unknown";
}

}  // namespace ist
