#include "robots/description/group_states.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "mesh/import/source_file.h"
#include "mesh/import/text_scanner.h"
#include "mesh/import/xml_document.h"

namespace ist {
namespace {

/// Calls `take` with each element of that name below the SRDF's root.
template <typename Take>
void for_each_element(const std::string& srdf, std::string_view name, const Take& take) {
  const SourceFile file = read_source_file(srdf);
  const XmlDocument xml(file);
  if (xml[0].name != "robot") xml.fail(0, "is not an SRDF, which begins with <robot name=\"…\">");
  for (std::uint32_t e = xml[0].first_child; e != XmlDocument::kNone; e = xml[e].next_sibling)
    if (xml[e].name == name) take(xml, e);
}

}  // namespace

std::vector<std::pair<std::string, Positions>> group_states(const RobotModel& robot,
                                                            const std::string& srdf) {
  std::vector<std::pair<std::string, Positions>> states;
  for_each_element(srdf, "group_state", [&](const XmlDocument& xml, std::uint32_t e) {
    Positions& positions =
        states.emplace_back(xml.attribute(e, "name"), default_positions(robot)).second;
    for (std::uint32_t j = xml[e].first_child; j != XmlDocument::kNone; j = xml[j].next_sibling) {
      const auto joint =
          std::find_if(robot.joints.begin(), robot.joints.end(),
                       [&](const RobotJoint& one) { return one.name == xml.attribute(j, "name"); });
      if (xml[j].name != "joint" || joint == robot.joints.end() || !joint->is_free()) continue;
      const std::optional<double> value = parse_real(xml.attribute(j, "value"));
      if (!value || !std::isfinite(*value)) xml.fail(j, "its value is not a finite number");
      positions[static_cast<std::size_t>(joint - robot.joints.begin())] = *value;
    }
  });
  return states;
}

DisabledCollisions disabled_collisions(const RobotModel& robot, const std::string& srdf) {
  DisabledCollisions out;
  for_each_element(srdf, "disable_collisions", [&](const XmlDocument& xml, std::uint32_t e) {
    const auto link = [&](const char* which) {
      const auto at =
          std::find_if(robot.links.begin(), robot.links.end(),
                       [&](const RobotLink& one) { return one.name == xml.attribute(e, which); });
      if (at == robot.links.end()) out.lacking.emplace(xml.attribute(e, which));
      return static_cast<std::size_t>(at - robot.links.begin());
    };
    const std::size_t a = link("link1"), b = link("link2");
    if (std::max(a, b) < robot.links.size()) out.pairs.emplace_back(a, b);
  });
  return out;
}

}  // namespace ist
